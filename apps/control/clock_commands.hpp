// What a running process can be asked of its clock.
// Layer: apps/control.  Thread: main; the handlers run on the serving thread.
#pragma once

#include <functional>
#include <string>

#include "apps/control/control_registry.hpp"
#include "runtime/robot_cycle.hpp"
#include "runtime/time_machine.hpp"

namespace tandem::apps {

/// How a run goes back in time.
struct RunPast {
  runtime::TimeMachine* machine = nullptr;  ///< null: it cannot
  std::string why_not{};                    ///< why, and what to do, as an error has it
  /// What a text means for the run as it is now; on the serving thread.
  std::function<Result<runtime::CycleCondition>(const std::string&)> condition{};
};

/// Adds the commands "clock.…". "clock.step" and "clock.until" do not wait for the loop: they are
/// through when "standing" is true again. Those that go back have stood when they answer. Refused
/// in real time, but "clock.show". Cycle and machine outlive the registry.
void add_clock_commands(ControlRegistry& registry, runtime::RobotCycle& cycle, RunPast past = {});

/// Whether simulated time stands, so that what is asked of the loop is kept for its next cycle.
[[nodiscard]] bool time_stands(const runtime::RobotCycle& cycle);

}  // namespace tandem::apps
