// A robot's files together: its TOML, its description, its drives' data sheets, and what kernels
// are made from. Layer: robot.  Thread: main.
#pragma once

#include <expected>
#include <string>

#include "base/result.hpp"
#include "hal/config/robot_config.hpp"
#include "model/model_spec.hpp"
#include "model/right_angles.hpp"
#include "model/tree.hpp"
#include "robot/complete_robot.hpp"

namespace tandem::robot {

struct RobotFiles {
  hal::RobotConfig config;  ///< completed from the description
  model::Tree tree;
  model::ModelSpec spec;
  model::RightAngles right_angles;  ///< what the description has of few digits
  Diagnostics warnings;             ///< what the description's reader tolerated
  FileTexts files{};                ///< what was read
};

/// Joins a completed robot and its description: whether its loops close anything, and whether its
/// dynamics can be solved, model::check_regular() with every posture. Nothing is read.
/// @param files  what the two were read from
[[nodiscard]] std::expected<RobotFiles, Diagnostics> join(hal::RobotConfig config,
                                                          const model::UrdfModel& description,
                                                          FileTexts files = {});

/// Reads the description that `config` names, completes the robot by it and joins the two.
/// @param read  files that were read before, which are not read again
[[nodiscard]] std::expected<RobotFiles, Diagnostics> with_description(hal::RobotConfig config,
                                                                      FileTexts read = {});

/// Whether the file is a robot's: a robot has a [model], an experiment names a robot.
[[nodiscard]] bool is_robot(const std::string& file);

/// A file's bytes; empty when it cannot be read.
[[nodiscard]] std::string text_of(const std::string& file);

/// Reads a robot.toml and its description, and joins them.
/// @param repair    as if it said inertia = "repair"
/// @param settings  what is otherwise than in the file
[[nodiscard]] std::expected<RobotFiles, Diagnostics> read_robot(
    const std::string& file, bool repair = false, const std::vector<TomlSetting>& settings = {});

}  // namespace tandem::robot
