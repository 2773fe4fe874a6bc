// The files of a new controller's project, as texts.
// Layer: apps/tools.  Thread: main.
#pragma once

#include <string>
#include <utility>
#include <vector>

namespace tandem::apps {

/// What a new controller's project is about.
struct ControllerProject {
  std::string name;        ///< a C++ identifier
  std::string robot_file;  ///< absolute path of its robot.toml
  std::string robot;       ///< the robot's name
  std::string posture;     ///< where it starts; empty: nowhere in particular
  std::string joint;       ///< that it moves
  double amplitude_rad = 0.0;
  std::string package;  ///< folder of tandemConfig.cmake
};

/// Name and text of each file.
[[nodiscard]] std::vector<std::pair<std::string, std::string>> controller_files(
    const ControllerProject& project);

}  // namespace tandem::apps
