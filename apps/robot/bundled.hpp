// Where the robots that come with Tandem stand.
// Layer: apps/robot.  Thread: main.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "base/result.hpp"

namespace tandem::apps {

/// Folders of bundled robots, each of which is a folder with a robot.toml: beside the working
/// directory, the build, or an installation.
[[nodiscard]] std::vector<std::filesystem::path> robot_folders();

/// The robot.toml of the bundled robot so named; empty when there is none.
[[nodiscard]] std::filesystem::path bundled_robot(const std::string& name);

/// The robot.toml that somebody names: a file, or the name of a bundled robot.
/// Errors: neither, with the nearest name.
[[nodiscard]] Result<std::filesystem::path> named_robot(const std::string& name);

}  // namespace tandem::apps
