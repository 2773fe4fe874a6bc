// What answers of shadows: controllers that run beside the active ones without commanding.
// Layer: apps/control.  Thread: any.
#pragma once

#include "apps/control/control_registry.hpp"
#include "hal/config/robot_config.hpp"
#include "runtime/run_services.hpp"

namespace tandem::apps {

/// Commands controller.shadow and controller.difference.
void add_shadow_commands(ControlRegistry& registry, runtime::RunServices& services,
                         const hal::RobotConfig& robot);

/// controller.switch with "when_within": what was asked for, and that it waits. Errors: a value in
/// a unit that is not the one of a joint's reference; RunServices::switch_when()'s.
[[nodiscard]] Result<runtime::RequestResult> switch_when(runtime::RunServices& services,
                                                         const hal::RobotConfig& robot,
                                                         const std::vector<std::string>& stop,
                                                         const std::vector<std::string>& start,
                                                         const Json& request);

}  // namespace tandem::apps
