// What a running `tandem run` can be asked for.
// Layer: apps.  Thread: main; the handlers run on the serving thread.
#pragma once

#include <memory>
#include <string>

#include "apps/control_registry.hpp"
#include "apps/control_socket.hpp"
#include "runtime/robot_cycle.hpp"

namespace tandem::apps {

/// Adds "status", "fault.show", "fault.reset", "estop" and "run.stop", and the commands of
/// controllers, joints and clock. Cycle and robot outlive the registry.
void add_run_commands(ControlRegistry& registry, runtime::RobotCycle& cycle,
                      const hal::RobotConfig& robot);

/// Serves `registry` at `path`, the default one of `kind` when it is empty. A socket that cannot be
/// opened is told on standard error and left out: it never stops a run.
[[nodiscard]] std::unique_ptr<ControlSocket> serve(const ControlRegistry& registry,
                                                   const std::string& path,
                                                   const std::string& kind);

}  // namespace tandem::apps
