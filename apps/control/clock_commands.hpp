// What a running process can be asked of its clock.
// Layer: apps/control.  Thread: main; the handlers run on the serving thread.
#pragma once

#include "apps/control/control_registry.hpp"
#include "runtime/robot_cycle.hpp"

namespace tandem::apps {

/// Adds "clock.show", "clock.pause", "clock.resume", "clock.step" and "clock.rate". None waits for
/// the loop: a step is through when "standing" is true again. Refused in real time, but
/// "clock.show". The cycle outlives the registry.
void add_clock_commands(ControlRegistry& registry, runtime::RobotCycle& cycle);

/// Whether simulated time stands, so that what is asked of the loop is kept for its next cycle.
[[nodiscard]] bool time_stands(const runtime::RobotCycle& cycle);

}  // namespace tandem::apps
