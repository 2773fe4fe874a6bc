// Faults into a running robot: the command's handler, whatever robot it is for.
// Layer: apps/run.  Thread: main; the handler runs on the serving thread.
#pragma once

#include <functional>

#include "apps/control/control_registry.hpp"
#include "hal/config/robot_config.hpp"
#include "hal/sim/fault_injection.hpp"
#include "model/tree.hpp"

namespace tandem::apps {

/// Adds a fault to the robot. @return an error when that cannot be
using AddFault = std::function<Status(const sim::ScenarioFault&)>;

/// The TOML of a request "push" or "inject".
[[nodiscard]] std::string scenario_of(const Json& request);

/// Adds "push": its request is a row of [[push]]. `add` empty: the robot is not simulated in this
/// process, and it is refused. As add_inject()'s otherwise.
void add_push(ControlRegistry& registry, const hal::RobotConfig& robot, const model::Tree* tree,
              std::int64_t period_ns, AddFault add);

/// Adds "inject" to `registry`: reads {"scenario": TOML text} for `robot` of that tree, which
/// both outlive the registry, and hands each of its faults to `add`.
void add_inject(ControlRegistry& registry, const hal::RobotConfig& robot, const model::Tree* tree,
                std::int64_t period_ns, AddFault add);

/// What the codes of EmulatedRobot::inject() mean.
[[nodiscard]] Status injected(Code code);

}  // namespace tandem::apps
