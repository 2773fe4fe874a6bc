// Faults into a running robot: the command's handler, whatever robot it is for.
// Layer: apps/run.  Thread: main; the handler runs on the serving thread.
#pragma once

#include <functional>

#include "apps/control/control_registry.hpp"
#include "hal/config/robot_config.hpp"
#include "hal/sim/fault_injection.hpp"
#include "model/tree.hpp"

namespace tandem::apps {

/// Adds "inject" to `registry`: reads {"scenario": TOML text} for `robot` of that tree, which
/// both outlive the registry, and hands each of its faults to `add`.
/// @param add  answers an error when the fault cannot be added
void add_inject(ControlRegistry& registry, const hal::RobotConfig& robot, const model::Tree* tree,
                std::int64_t period_ns, std::function<Status(const sim::ScenarioFault&)> add);

/// What the codes of EmulatedRobot::inject() mean.
[[nodiscard]] Status injected(Code code);

}  // namespace tandem::apps
