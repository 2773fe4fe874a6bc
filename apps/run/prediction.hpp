// Prediction in a run: the copy that is run ahead, and the command that asks for it.
// Layer: apps/run.  Thread: main; the copy is made on the prediction's thread, the command runs on
// the serving thread.
#pragma once

#include <memory>

#include "apps/control/control_registry.hpp"
#include "apps/run/composition.hpp"
#include "base/result.hpp"
#include "internal_model/prediction_service.hpp"
#include "runtime/cycle_config.hpp"

namespace tandem::apps {

/// Makes the copy of a run: its controllers once more, on the internal model, or on the run's own
/// simulation. The composition outlives it.
/// @param config  of the run's cycle
/// Errors: a plugin that cannot be loaded or configured any more; SimRobot::create()'s.
[[nodiscard]] Result<std::unique_ptr<internal_model::Fork>> make_fork(
    const Composition& composition, const runtime::CycleConfig& config);

/// Adds "predict". @param service  null: the run has no model of its robot, which is the answer
void add_predict(ControlRegistry& registry, internal_model::PredictionService* service,
                 const hal::RobotConfig& robot);

}  // namespace tandem::apps
