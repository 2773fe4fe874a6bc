// What the simulated robot carries: read from a table, and as the plant takes it.
// Layer: hal/sim.  Thread: reading non-RT; the rest any.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "base/realtime.hpp"
#include "base/toml_reader.hpp"
#include "hal/config/robot_config.hpp"
#include "hal/sim/fault_injection.hpp"
#include "model/tree.hpp"

namespace tandem::sim {

/// A rigid thing that is fixed to a link, and moves with it from the start.
struct Load {
  std::size_t link = 0;    ///< of the tree
  model::Inertia in_link;  ///< in the link's frame
};

/// "1.6 kg on panda_hand"
[[nodiscard]] std::string words_of(const ScenarioFault& payload, const model::Tree& tree);

/// "1600 kg on link2 is heavier than the whole robot, 3.2 kg"; empty: it is not.
[[nodiscard]] std::string too_heavy(const ScenarioFault& payload, const model::Tree& tree);

/// What a fault of kind kPayload attaches.
[[nodiscard]] Load load_of(const ScenarioFault& payload) noexcept TANDEM_RT;

/// Reads `link` or `site`: which link of the tree, in `fault`, with the joint of the image that
/// moves it. @return the frame in which numbers are given there; empty, after an error: neither of
/// them, both, one that is not there or does not move
/// @param not_there  "it carries nothing": of what is fixed to the world
[[nodiscard]] std::optional<model::Placement> read_place(TomlTable& table,
                                                         const hal::RobotConfig& robot,
                                                         const model::Tree* tree,
                                                         const std::string& not_there,
                                                         ScenarioFault& fault);

/// Reads what a payload is, of a [[fault]] or of [[sim.payload]]: `link` or `site`, mass_kg, com_m
/// and inertia_kg_m2. Errors, in the table: none or both of the first two, one that is not there,
/// a mass that is not above 0, an inertia that no body has.
void read_payload(TomlTable& table, const hal::RobotConfig& robot, const model::Tree* tree,
                  ScenarioFault& payload);

/// The place among `known` of the name that a key has to have; -1, after an error with the nearest.
[[nodiscard]] std::int32_t index_in(TomlTable& table, const char* key,
                                    const std::vector<std::string>& known);

}  // namespace tandem::sim
