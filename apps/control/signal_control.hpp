// What a running run can be asked for of its controllers' signals.
// Layer: apps/control.  Thread: main; the handlers run on the serving thread.
#pragma once

#include "apps/control/control_registry.hpp"
#include "hal/config/robot_config.hpp"
#include "runtime/run_services.hpp"

namespace tandem::apps {

/// Adds "signal.list". Services and robot outlive the registry.
void add_signal_commands(ControlRegistry& registry, runtime::RunServices& services,
                         const hal::RobotConfig& robot);

}  // namespace tandem::apps
