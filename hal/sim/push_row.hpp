// What a push is, read from a table.
// Layer: hal/sim.  Thread: reading non-RT; area() any.
#pragma once

#include "base/realtime.hpp"
#include "base/toml_reader.hpp"
#include "hal/config/robot_config.hpp"
#include "hal/sim/fault_injection.hpp"
#include "model/tree.hpp"

namespace tandem::sim {

/// The area under a shape of height 1 from its begin to `s`, in durations; 0 to 1 is its whole.
[[nodiscard]] double area(PushShape shape, double s) noexcept TANDEM_RT;

/// Reads the place, the wrench and the shape of a push, whose times are read already: one of
/// `joint`, `link` and `site`; `force_N` and `torque_Nm`, or `impulse_Ns` and `impulse_Nms`, which
/// its duration divides; `point_m`, `frame` and `shape`.
/// Errors, in the table: a place that is not there or cannot move; neither a force nor an impulse,
/// or both; a duration that is missing or 0 where one is needed.
void read_push(TomlTable& table, const hal::RobotConfig& robot, const model::Tree* tree,
               ScenarioFault& push);

}  // namespace tandem::sim
