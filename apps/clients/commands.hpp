// The commands of `tandem` that talk to running processes. Each prints for people, writes JSON when
// asked, and answers the exit status.
// Layer: apps/clients.  Thread: main.
#pragma once

#include "apps/command_line/command_line.hpp"

namespace tandem::apps {

/// What a run has latched, and the request to clear it. Exit::kFault: a cause is still there.
[[nodiscard]] Exit fault_command(const FaultOptions& options);
[[nodiscard]] Exit estop_command(const EstopOptions& options);
/// Controllers of a running run: what is loaded, and changes of it.
[[nodiscard]] Exit controller_command(const ControllerOptions& options);
/// Joints of a running run: what they are, and changes of them. Exit::kFault: a motion that was
/// waited for ended elsewhere; a drive's cause is still there.
[[nodiscard]] Exit joint_command(const JointOptions& options);
/// Sensors of a running run: where they are, and what they measure.
[[nodiscard]] Exit sensor_command(const SensorOptions& options);
/// Pauses and steps until simulated time stands.
[[nodiscard]] Exit clock_command(const ClockOptions& options);
/// What a running robot will do, by its model.
[[nodiscard]] Exit predict_command(const PredictOptions& options);
/// Asks a running process one thing and prints its answer.
[[nodiscard]] Exit ask_command(const AskOptions& options);
/// Asks a running `tandem emulate` or `run` to inject a fault.
[[nodiscard]] Exit inject_command(const InjectOptions& options);
/// Topics of a DDS domain: a list, samples as text, rates.
[[nodiscard]] Exit topic_command(const TopicOptions& options);

}  // namespace tandem::apps
