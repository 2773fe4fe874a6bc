// Reactions that need a controller which can bring the robot to a safe posture.
// Layer: apps/run.  Thread: main.
#pragma once

#include "base/result.hpp"
#include "runtime/run/composition.hpp"

namespace tandem::runtime {

/// Warnings, when no controller of `c` can retreat: of the stops of category 2 that robot.toml asks
/// for, and of a collision's "retract". They will be of category 1.
[[nodiscard]] Diagnostics missing_retreats(const Composition& c);

}  // namespace tandem::runtime
