// The files that identification writes: description, robot and experiments.
// Layer: apps/tools.  Thread: main.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "identification/identify.hpp"
#include "robot/robot_files.hpp"

namespace tandem::apps {

/// What was written, and what robot.toml has no place for.
struct IdentifiedFiles {
  std::vector<std::string> paths;  ///< robot.toml first
  std::vector<std::string> notes;
};

/// A drive's figures as robot.toml has them: the mean over the joints that it moves, each weighted
/// by its own interval; nothing of what the data do not give.
struct ActuatorFigures {
  std::string name;
  std::optional<double> inertia_kg_m2, damping_Nms_rad;
};
[[nodiscard]] std::vector<ActuatorFigures> actuator_figures(
    const hal::RobotConfig& robot, const identification::Identification& result);

/// The text with these figures in [actuator.NAME], comments kept. What stands in
/// [actuator_defaults] only is added below the table's head; a table written in another way stays.
[[nodiscard]] std::string with_actuators(const std::string& text,
                                         const std::vector<ActuatorFigures>& figures);

/// Whether write_identified() and the report destroy nothing: every file of theirs that is there
/// already was written by `tandem identify`, and is neither the robot nor its description.
///
/// Errors: the first file that would be lost.
[[nodiscard]] Status check_identified(const robot::RobotFiles& robot,
                                      const std::vector<std::string>& logs,
                                      const std::string& folder);

/// Writes into `folder`: ROBOT.urdf, the description with the identified inertias; robot.toml, the
/// robot with that description and its drives' friction and rotor inertia, named NAME_identified;
/// and the experiment of every log whose file carries it, with that robot. Then reads the robot
/// back. Each of these files says that `tandem identify` wrote it.
///
/// Errors: a file cannot be written; what was written does not read back as what was identified.
[[nodiscard]] Result<IdentifiedFiles> write_identified(const robot::RobotFiles& robot,
                                                       const identification::Identification& result,
                                                       const std::vector<std::string>& logs,
                                                       const std::string& folder);

/// A robot.toml's text for another folder: with this name and description, without
/// [model.link.NAME], whose figures the description has now, and with paths that still lead to
/// their files.
/// @param folder  of the original
[[nodiscard]] std::string moved_robot(const std::string& text, const std::string& folder,
                                      const std::string& name, const std::string& urdf);

}  // namespace tandem::apps
