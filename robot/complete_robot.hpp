// A robot.toml completed by the URDF that it names.
// Layer: robot.  Thread: non-RT.
#pragma once

#include <expected>
#include <string>
#include <utility>
#include <vector>

#include "base/result.hpp"
#include "base/toml_setting.hpp"
#include "hal/config/robot_config.hpp"
#include "model/urdf.hpp"

namespace tandem::robot {

/// Files by their paths, as they were read: what is run, whatever stands there later.
using FileTexts = std::vector<std::pair<std::string, std::string>>;

/// The text of one of them; empty: it is none of them.
[[nodiscard]] std::string text_in(const FileTexts& files, const std::string& path);

/// A robot.toml with its description.
struct CompleteRobot {
  hal::RobotConfig config;
  model::UrdfModel description;
  FileTexts files;  ///< both
};

/// The joints of the description that follow a joint of the image.
[[nodiscard]] std::vector<hal::Follower> followers_of(const hal::RobotConfig& robot,
                                                      const model::Tree& tree);

/// Reads a robot.toml and its URDF. Errors: those of both at once, read_robot_config()'s and
/// complete_robot()'s.
/// @param repair    as if it said inertia = "repair"
/// @param settings  what is otherwise than in the file
[[nodiscard]] std::expected<CompleteRobot, Diagnostics> read_complete_robot(
    const std::string& file, bool repair = false, const std::vector<TomlSetting>& settings = {});

/// Reads the robot's URDF and fills from it what robot.toml left out: limits, the heights of
/// postures that are "auto", and its followers. Errors: read_urdf()'s and
/// complete_from_description()'s. The answer holds the tree and what was tolerated in it.
///
/// @param read  files that were read before: when the URDF is one of them, it is not read again
[[nodiscard]] std::expected<model::UrdfModel, Diagnostics> complete_robot(
    hal::RobotConfig& robot, const FileTexts& read = {});

}  // namespace tandem::robot
