// The commands of `tandem`. Each prints for people, writes JSON when asked, and answers the
// exit status.
// Layer: apps/run.  Thread: main.
#pragma once

#include "apps/command_line/command_line.hpp"
#include "base/result.hpp"

namespace tandem::report {
struct ReportFiles;
}  // namespace tandem::report

namespace tandem::apps {

/// Reads every file first, and runs only when all is right.
[[nodiscard]] Exit run_command(const RunOptions& options);
/// Runs a robot without controllers of its own, for owners in other processes.
[[nodiscard]] Exit serve_command(const ServeOptions& options);
/// What a run has latched, and the request to clear it. Exit::kFault: a cause is still there.
[[nodiscard]] Exit fault_command(const FaultOptions& options);
[[nodiscard]] Exit estop_command(const EstopOptions& options);
/// Controllers of a running run: what is loaded, and changes of it.
[[nodiscard]] Exit controller_command(const ControllerOptions& options);
/// Joints of a running run: what they are, and changes of them.
[[nodiscard]] Exit joint_command(const JointOptions& options);
/// Pauses and steps until simulated time stands.
[[nodiscard]] Exit clock_command(const ClockOptions& options);
/// Asks a running process one thing and prints its answer.
[[nodiscard]] Exit ask_command(const AskOptions& options);
/// The robot on the other end of the wire, until it is asked to stop.
[[nodiscard]] Exit emulate_command(const EmulateOptions& options);
/// Reads every file, says what a run would do, moves nothing.
[[nodiscard]] Exit check_command(const CheckOptions& options);
/// Asks a running `tandem emulate` or `run` to inject a fault.
[[nodiscard]] Exit inject_command(const InjectOptions& options);
[[nodiscard]] Exit model_command(const ModelOptions& options);
/// Writes a robot's folder from its description: robot.toml, hold.toml, move.toml.
[[nodiscard]] Exit new_command(const NewOptions& options);
[[nodiscard]] Exit log_command(const LogOptions& options);
/// Writes a data sheet per type of board and sensor.
[[nodiscard]] Exit eds_command(const EdsOptions& options);
[[nodiscard]] Exit report_command(const ReportOptions& options);
/// Says what of the machine stands in the way of real time; exit status 0 whatever it finds.
[[nodiscard]] Exit doctor_command(const DoctorOptions& options);
/// Topics of a DDS domain: a list, samples as text, rates.
[[nodiscard]] Exit topic_command(const TopicOptions& options);
/// Measures; judges nothing.
[[nodiscard]] Exit latency_command(const LatencyOptions& options);

/// What report_command() draws, for a run that ends with its report.
[[nodiscard]] Result<report::ReportFiles> draw_report(const ReportOptions& options);

}  // namespace tandem::apps
