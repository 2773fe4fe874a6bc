// The files that identification writes: description, robot and experiments.
// Layer: apps/tools.  Thread: main.
#pragma once

#include <string>
#include <vector>

#include "apps/robot/robot_files.hpp"
#include "base/result.hpp"
#include "identification/identify.hpp"

namespace tandem::apps {

/// Writes into `folder`: ROBOT.urdf, the description with the identified inertias; robot.toml, the
/// robot with that description, named NAME_identified; and the experiment of every log whose file
/// carries it, with that robot. Then reads the robot back.
///
/// @return the paths written, robot.toml first
/// Errors: a file cannot be written; what was written does not read back as what was identified.
[[nodiscard]] Result<std::vector<std::string>> write_identified(
    const RobotFiles& robot, const identification::Identification& result,
    const std::vector<std::string>& logs, const std::string& folder);

/// A robot.toml's text for another folder: with this name and description, without
/// [model.link.NAME], whose figures the description has now, and with paths that still lead to
/// their files.
/// @param folder  of the original
[[nodiscard]] std::string moved_robot(const std::string& text, const std::string& folder,
                                      const std::string& name, const std::string& urdf);

}  // namespace tandem::apps
