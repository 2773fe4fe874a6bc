// The command that asks a run how far its expectations are.
// Layer: apps/run.  Thread: main; the command runs on the serving thread.
#pragma once

#include "apps/control/control_registry.hpp"
#include "runtime/condition/expectations.hpp"
#include "runtime/robot_cycle.hpp"

namespace tandem::apps {

/// Adds "expect.show". @param expectations  null: the experiment has none. All outlive the registry
void add_expectations(ControlRegistry& registry, runtime::RobotCycle& cycle,
                      runtime::Expectations* expectations);

}  // namespace tandem::apps
