// The ground of a simulated robot: [[sim.patch]], [[sim.ground]], [[sim.shake]].
// Layer: hal/config.  Thread: non-RT.
#pragma once

#include <array>
#include <string>
#include <string_view>
#include <vector>

#include "base/keys.hpp"
#include "base/result.hpp"
#include "base/toml_reader.hpp"
#include "hal/config/robot_config.hpp"

namespace tandem::hal {

/// Lists of tables below [sim].
inline constexpr std::array kGroundTables{"patch", "ground", "shake"};

/// What was read, in words.
struct GroundWords {
  std::vector<std::string> differences;  ///< "ground ramp: name = \"ramp\", slope_deg = 5, …"
  std::string toml;                      ///< the same tables, for read_ground() of a log
};

/// Adds them to a ground. Errors go to the tables.
void read_ground(TomlTable& sim, ContactConfig& ground, GroundWords& words);
/// The same from GroundWords::toml. @param file  for messages
[[nodiscard]] Status read_ground(const std::string& toml, const std::string& file,
                                 ContactConfig& ground);
/// "key = value" of a table, with `between` between two: TOML, where that is a new line.
[[nodiscard]] std::string values_text(const TomlTable& table, std::string_view between);
/// Their keys, for the page.
void describe_ground(KeyPage& page);

}  // namespace tandem::hal
