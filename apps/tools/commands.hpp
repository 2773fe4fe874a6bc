// The commands of `tandem` that work on files. Each prints for people, writes JSON when
// asked, and answers the exit status.
// Layer: apps/tools.  Thread: main.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "apps/command_line/command_line.hpp"
#include "apps/text/figures.hpp"
#include "base/result.hpp"

namespace tandem::robot {
struct RobotFiles;
}  // namespace tandem::robot

namespace tandem::apps {

[[nodiscard]] Exit model_command(const ModelOptions& options);
/// A part of it: writes a robot's package for ROS 2 and MoveIt.
[[nodiscard]] Status write_ros2_package(const robot::RobotFiles& robot,
                                        const ModelOptions& options);
/// Writes a robot's folder from its description: robot.toml, hold.toml, move.toml.
[[nodiscard]] Exit new_command(const NewOptions& options);
/// Writes the project of a new controller: source, tests, experiment, build.
[[nodiscard]] Exit controller_new_command(const ControllerNewOptions& options);
[[nodiscard]] Exit log_command(const LogOptions& options);
/// A part of log_command().
[[nodiscard]] Exit log_import_command(const LogOptions& options);
/// The same: a copy at a lower rate.
[[nodiscard]] Status export_log(const LogOptions& options);
/// The same.
[[nodiscard]] Exit log_replay_command(const LogOptions& options);
/// Writes a data sheet per type of board and sensor; with `show`, prints what a sheet says.
[[nodiscard]] Exit eds_command(const EdsOptions& options);
/// Serves logs to a browser until a signal ends it.
[[nodiscard]] Exit studio_of_logs(const StudioCommandOptions& options);
/// A part of it: what a drive is and can, by its data sheet.
[[nodiscard]] Exit eds_show(const EdsOptions& options);
[[nodiscard]] Exit report_command(const ReportOptions& options);
/// Simulates the experiment in a file. @return what ended it early; empty: nothing
/// Errors: it cannot be started.
using Trial = std::function<Result<std::string>(const std::string& experiment)>;
/// An experiment that excites a robot's dynamics. Of a floating base it is tried, and made gentler
/// until it runs through.
[[nodiscard]] Exit excite_command(const ExciteOptions& options, const Trial& trial);
/// Masses, inertias and friction from logs; writes a robot with them, and a page.
[[nodiscard]] Exit identify_command(const IdentifyOptions& options);

/// What their JSON has, for docs/json.md.
[[nodiscard]] std::vector<Figures::Row> eds_figures();
[[nodiscard]] std::vector<Figures::Row> excite_figures();
[[nodiscard]] std::vector<Figures::Row> identify_figures();
[[nodiscard]] std::vector<Figures::Row> import_figures();
[[nodiscard]] std::vector<Figures::Row> log_figures();
[[nodiscard]] std::vector<Figures::Row> replay_figures();

}  // namespace tandem::apps
