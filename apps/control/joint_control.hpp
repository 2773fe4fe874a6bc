// What a running run can be asked for of its joints.
// Layer: apps/control.  Thread: main; the handlers run on the serving thread.
#pragma once

#include "apps/control/control_registry.hpp"
#include "hal/config/robot_config.hpp"
#include "runtime/robot_cycle.hpp"

namespace tandem::apps {

/// Adds "joint.list", "joint.set", "joint.move", "joint.stop", "joint.home", "joint.recover",
/// "joint.reset" and "joint.gains". Cycle and robot outlive the registry.
void add_joint_commands(ControlRegistry& registry, runtime::RobotCycle& cycle,
                        const hal::RobotConfig& robot);

}  // namespace tandem::apps
