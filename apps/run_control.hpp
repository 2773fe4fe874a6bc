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

/// How a process takes questions over a socket.
struct ControlSocketOptions {
  std::string path;     ///< empty: the default one of `kind`
  std::string kind;     ///< "run", "emulate"
  bool wanted = true;   ///< false: none is opened
  bool needed = false;  ///< a robot moves: without a way to stop it nothing starts
};

/// Serves `registry`; null when no socket is wanted, or when it cannot be opened and is not needed,
/// which is said on standard error. Errors: a socket that is needed and cannot be opened.
[[nodiscard]] Result<std::unique_ptr<ControlSocket>> serve(const ControlRegistry& registry,
                                                           const ControlSocketOptions& options);

}  // namespace tandem::apps
