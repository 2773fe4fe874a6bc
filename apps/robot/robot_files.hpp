// A robot's files together: its TOML, its description, and what kernels are made from.
// Layer: apps/robot.  Thread: main.
#pragma once

#include <expected>
#include <optional>
#include <string>

#include "base/result.hpp"
#include "hal/config/robot_config.hpp"
#include "model/model_spec.hpp"
#include "model/right_angles.hpp"
#include "model/tree.hpp"
#include "runtime/complete_robot.hpp"

namespace tandem::apps {

struct RobotFiles {
  hal::RobotConfig config;  ///< completed from the description
  model::Tree tree;
  model::ModelSpec spec;
  model::RightAngles right_angles;  ///< what the description has of few digits
  Diagnostics warnings;             ///< what the description's reader tolerated
  runtime::FileTexts files{};       ///< what was read
};

/// A warning for a floating base that nothing carries.
[[nodiscard]] std::optional<Error> falls_for_ever(const hal::RobotConfig& robot);

/// Reads the description that `config` names, checks the two against each other, and that the
/// robot's dynamics can be solved: model::check_regular(), with every posture.
/// @param read  files that were read before, which are not read again
[[nodiscard]] std::expected<RobotFiles, Diagnostics> with_description(hal::RobotConfig config,
                                                                      runtime::FileTexts read = {});

/// Whether the file is a robot's: a robot has a [model], an experiment names a robot.
[[nodiscard]] bool is_robot(const std::string& file);

/// A file's bytes; empty when it cannot be read.
[[nodiscard]] std::string text_of(const std::string& file);

/// Reads a robot.toml and its description.
/// @param repair  as if it said inertia = "repair"
[[nodiscard]] std::expected<RobotFiles, Diagnostics> read_robot(const std::string& file,
                                                                bool repair = false);

}  // namespace tandem::apps
