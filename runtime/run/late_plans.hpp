// What the controllers of an experiment plan for a time after its end.
// Layer: apps/run.  Thread: main.
#pragma once

#include "base/result.hpp"
#include "runtime/run/composition.hpp"

namespace tandem::runtime {

/// A warning of each active controller that plans something for later than the run's end, with the
/// key, both times and how much else is late.
[[nodiscard]] Diagnostics late_plans(const Composition& composition);

}  // namespace tandem::runtime
