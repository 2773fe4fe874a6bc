// The ground of a simulated robot: [[sim.patch]], [[sim.ground]], [[sim.shake]].
// Layer: runtime.  Thread: non-RT.
#pragma once

#include <array>
#include <string>

#include "base/keys.hpp"
#include "base/toml_reader.hpp"
#include "hal/sim/plant_changes.hpp"

namespace tandem::runtime {

/// Lists of tables below [sim].
inline constexpr std::array kGroundTables{"patch", "ground", "shake"};

/// Adds them to the plant's own ground. Errors go to the tables.
void read_ground(TomlTable& sim, sim::PlantChanges& plant);
/// Their keys, for the page.
void describe_ground(KeyPage& page);

/// "link panda_link4: mass_kg = 3", as the table says it, among the plant's differences.
void note_difference(const std::string& what, const TomlTable& table, sim::PlantChanges& plant);

}  // namespace tandem::runtime
