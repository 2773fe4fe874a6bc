// What a running run can be asked for of its joints.
// Layer: apps/control.  Thread: main; the handlers run on the serving thread.
#pragma once

#include <array>
#include <functional>
#include <vector>

#include "apps/control/control_registry.hpp"
#include "hal/config/robot_config.hpp"
#include "runtime/robot_cycle.hpp"

namespace tandem::apps {

/// What a robot's model says of the gains that a joint of it is to get: `stability` of
/// docs/json.md.
/// @param gains  of all loops of the joint, as they will be
/// @param position_rad  of every joint, as measured
using JudgeGains = std::function<Json(std::size_t joint, hal::PidLoop loop,
                                      const std::array<hal::PidGains, hal::kPidLoops>& gains,
                                      const std::vector<double>& position_rad)>;

/// Adds "joint.list", "joint.set", "joint.move", "joint.stop", "joint.home", "joint.recover",
/// "joint.reset" and "joint.gains". Cycle and robot outlive the registry.
/// @param judge  empty: there is no model, gains are taken unjudged
void add_joint_commands(ControlRegistry& registry, runtime::RobotCycle& cycle,
                        const hal::RobotConfig& robot, JudgeGains judge = {});

}  // namespace tandem::apps
