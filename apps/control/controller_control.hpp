// What a running run can be asked for of its controllers.
// Layer: apps/control.  Thread: main; the handlers run on the serving thread.
#pragma once

#include "apps/control/control_registry.hpp"
#include "runtime/run_services.hpp"

namespace tandem::apps {

/// Adds "controller.list", "controller.load", "controller.reload", "controller.unload",
/// "controller.start", "controller.stop" and "controller.switch". Services and robot outlive the
/// registry.
void add_controller_commands(ControlRegistry& registry, runtime::RunServices& services,
                             const hal::RobotConfig& robot);

/// {"done": …, "cycle": …}: what became of a request.
[[nodiscard]] Json asked_json(const runtime::RequestResult& asked);

}  // namespace tandem::apps
