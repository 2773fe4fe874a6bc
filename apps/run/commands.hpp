// The commands of `tandem` that run a robot, or stop right before that. Each prints for people,
// writes JSON when asked, and answers the exit status.
// Layer: apps/run.  Thread: main.
#pragma once

#include <vector>

#include "apps/command_line/command_line.hpp"
#include "apps/run/gate.hpp"
#include "apps/run/tools_program.hpp"
#include "apps/text/figures.hpp"

namespace tandem::apps {

/// Reads every file first, and runs only when all is right.
/// @param report  what is to be drawn afterwards
[[nodiscard]] Exit run_command(const RunOptions& options, ReportOfRun& report);
/// Runs a robot without controllers of its own, for owners in other processes.
[[nodiscard]] Exit serve_command(const ServeOptions& options, ReportOfRun& report);
/// The robot on the other end of the wire, until it is asked to stop.
[[nodiscard]] Exit emulate_command(const EmulateOptions& options);
/// What its JSON has, for docs/json.md.
[[nodiscard]] std::vector<Figures::Row> emulate_figures();
/// Reads every file, says what a run would do, moves nothing.
[[nodiscard]] Exit check_command(const CheckOptions& options);

/// Runs every experiment that expects something, each in a process of its own.
[[nodiscard]] Exit test_command(const TestOptions& options);

/// Runs every point of a study, each in a process of its own.
[[nodiscard]] Exit sweep_command(const SweepOptions& options);

/// Plays a run again from its log. @return kFault where something differs
[[nodiscard]] Exit replay_command(const ReplayCommandOptions& options);

/// Runs a controller's library under the gate's traps, and rewinds the run.
[[nodiscard]] Exit controller_check_command(const ControllerCheckOptions& options);
struct ControllerCheckResult {
  std::string plugin;
  bool kept = true;
  std::vector<std::string> faults{};
  std::vector<GateResult> rules{};
};
void figures(Figures& f, const ControllerCheckResult& result);

}  // namespace tandem::apps
