// What a running `tandem run` can be asked for.
// Layer: apps/control.  Thread: main; the handlers run on the serving thread.
#pragma once

#include <functional>
#include <string>

#include "apps/control/clock_commands.hpp"
#include "apps/control/controller_control.hpp"
#include "apps/control/joint_control.hpp"
#include "apps/control/joint_group.hpp"
#include "runtime/robot_cycle.hpp"

namespace tandem::apps {

/// What a run has beside its cycle.
struct RunWires {
  std::string hal{};  ///< "loop.show" tells it: the backend: "sim", "can"
  /// A list of bus_states()'; called on the serving thread. Empty: there is no bus.
  std::function<Json()> buses{};
  LeadSite lead{};  ///< add_group_commands()'s
  RunPast past{};   ///< add_clock_commands()'
};

/// Adds "status", "loop.show", "fault.show", "fault.reset", "estop" and "run.stop", and the
/// commands of controllers, joints, sensors and clock. Cycle and robot outlive the registry.
/// @param judge  add_joint_commands()'s
/// @param trial  add_controller_commands()'s
void add_run_commands(ControlRegistry& registry, runtime::RobotCycle& cycle,
                      const hal::RobotConfig& robot, JudgeGains judge = {},
                      TryController trial = {}, RunWires wires = {});

}  // namespace tandem::apps
