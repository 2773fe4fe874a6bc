// What the events of an experiment ask for: checked before the run, carried out by its registry.
// Layer: apps/run.  Thread: main; requests in the loop's, between the halves of a cycle.
#pragma once

#include "apps/control/control_registry.hpp"
#include "apps/control/controller_control.hpp"
#include "apps/run/connection.hpp"
#include "base/result.hpp"
#include "runtime/events.hpp"
#include "runtime/experiment.hpp"
#include "runtime/robot_cycle.hpp"

namespace tandem::apps {

/// What is wrong with the requests, as far as that is known before anything moves: a command that
/// is not there or not for events, its keys, a joint that the robot lacks, faults.
[[nodiscard]] Diagnostics check_events(const runtime::Experiment& e);

/// What a run would refuse of them whatever it does before: its own commands say so, in a run of
/// `c` that makes no cycle. `c` runs nothing afterwards. Nothing without kernels, which are
/// missing.
/// @param trial  of controllers that are loaded
[[nodiscard]] Diagnostics ask_ahead(WiredComposition& c, const TryController& trial);

/// From now on `registry` carries them out. All outlive the cycles.
void carry_out(runtime::Events& events, const ControlRegistry& registry,
               runtime::RobotCycle& cycle);

}  // namespace tandem::apps
