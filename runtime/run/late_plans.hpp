// What the controllers of an experiment plan, or are to be told, for a time after its end.
// Layer: apps/run.  Thread: main.
#pragma once

#include "base/result.hpp"
#include "runtime/run/composition.hpp"

namespace tandem::runtime {

/// A warning of each active controller that plans something for later than the run's end, with the
/// key, both times and how much else is late; and of each of its inputs whose timeline or file goes
/// on after it, with the first such row.
[[nodiscard]] Diagnostics late_plans(const Composition& composition);

/// A warning of each input whose timeline or file has no row.
[[nodiscard]] Diagnostics empty_plans(const Composition& composition);

}  // namespace tandem::runtime
