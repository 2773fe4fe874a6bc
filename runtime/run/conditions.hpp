// What of a run is decided by conditions: expectations and events.
// Layer: runtime/run.  Thread: non-RT only.
#pragma once

#include "base/result.hpp"
#include "runtime/run/composition.hpp"

namespace tandem::runtime {

/// Why the experiment's events cannot come with the robot that it is run with; empty: they can, or
/// there are none.
[[nodiscard]] Diagnostics unfit_for_events(const Experiment& e, bool serves);

/// Looks up what [[expect]], and the events' `when`, name: Composition::expectations and events.
/// @pre the backend is there, when it is simulated
[[nodiscard]] Diagnostics look_up_conditions(Composition& c);

}  // namespace tandem::runtime
