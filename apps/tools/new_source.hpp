// What `tandem new` makes a robot from: the description, expanded and cut as the options say.
// Layer: apps/tools.  Thread: main.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "apps/command_line/command_line.hpp"
#include "base/result.hpp"

namespace tandem::apps {

struct NewSource {
  std::string name;                                    ///< of the file that was read
  std::string copy;                                    ///< of the URDF in the robot's folder
  std::string text;                                    ///< of that URDF
  std::vector<std::pair<std::string, double>> lock{};  ///< joint -> where it stands [rad or m]
  std::vector<std::string> remarks{};                  ///< what the options have changed
  bool changed = false;  ///< `text` is not the file's: lines are others
  /// Links that --density has looked at, and what came of it: "3.14 kg (guess: 1 shape)".
  std::vector<std::pair<std::string, std::string>> masses{};
};

/// The name of a description's robot: "arm" of arm.urdf, arm.xacro and arm.urdf.xacro.
[[nodiscard]] std::string robot_stem(const std::string& file);

/// Reads the description. A .xacro file is expanded by the program `xacro`; --drop and --density
/// change the text.
/// Errors: the file cannot be read; no `xacro`, or it fails; an option names what is not there, or
/// has no number.
[[nodiscard]] Result<NewSource> read_source(const NewOptions& options);

/// Errors of locks that --lock has asked for, as the reader of robot.toml words them, with the
/// option instead of the key.
/// @param source  of what was read: where --density found no mass, the hint says why
[[nodiscard]] Diagnostics of_options(Diagnostics errors, const NewSource& source);

}  // namespace tandem::apps
