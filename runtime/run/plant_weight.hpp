// What the robot weighed that was simulated, with what it carried.
// Layer: runtime/run.  Thread: one at a time, between two cycles.
#pragma once

#include <optional>

#include "runtime/robot_cycle.hpp"
#include "runtime/run/composition.hpp"

namespace tandem::runtime {

/// What the ground did, against the weight of the plant as it is: payloads included, and on the
/// average where that changes. Empty as RunStatistics::ground()'s.
[[nodiscard]] std::optional<GroundFigures> ground_of(const Composition& c, const RobotCycle& cycle);

}  // namespace tandem::runtime
