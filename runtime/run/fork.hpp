// The copy of a run that a prediction runs ahead in.
// Layer: runtime/run.  Thread: the prediction's.
#pragma once

#include <memory>

#include "base/result.hpp"
#include "internal_model/prediction_service.hpp"
#include "runtime/cycle_config.hpp"
#include "runtime/run/composition.hpp"

namespace tandem::runtime {

/// Makes the copy of a run: its controllers once more, on the internal model, or on the run's own
/// simulation. The composition outlives it.
/// @param config  of the run's cycle
/// Errors: a plugin that cannot be loaded or configured any more; SimRobot::create()'s.
[[nodiscard]] Result<std::unique_ptr<internal_model::Fork>> make_fork(const Composition& c,
                                                                      const CycleConfig& config);

}  // namespace tandem::runtime
