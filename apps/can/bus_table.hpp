// The load of a robot's buses as a table and as JSON.
// Layer: apps/can.  Thread: main.
#pragma once

#include <cstdint>
#include <cstdio>

#include "apps/text/figures.hpp"
#include "base/result.hpp"
#include "hal/config/robot_config.hpp"
#include "hal/ethercat-can/bus_load.hpp"

namespace tandem::apps {

/// docs/json.md, `tandem check --bus`
void figures(Figures& f, const hal::can::BusLoad& load);

/// Prints what each bus carries at `period_ns` and whether it fits, and puts the same into `json`.
/// Errors: those of the PDO layout. That a bus does not fit is in the table, and no error here.
[[nodiscard]] Diagnostics show_buses(const hal::RobotConfig& robot, std::int64_t period_ns,
                                     std::FILE* out, Json& json);

}  // namespace tandem::apps
