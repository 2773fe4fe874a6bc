// What of a scenario nobody will see, or believe: a run goes on with it.
// Layer: apps/run.  Thread: main.
#pragma once

#include "base/result.hpp"
#include "runtime/experiment.hpp"

namespace tandem::apps {

/// Adds a warning for each row that is due after the run's end, and for each motion of the ground
/// that is harder than any earthquake. Nothing where no simulation has an end.
void add_scenario_warnings(const runtime::Experiment& e, Diagnostics& warnings);

}  // namespace tandem::apps
