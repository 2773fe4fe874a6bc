// Prediction in a run: the copy that is run ahead, and the command that asks for it.
// Layer: apps/run.  Thread: main; the copy is made on the prediction's thread, the command runs on
// the serving thread.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>

#include "apps/control/control_registry.hpp"
#include "apps/run/connection.hpp"
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

/// Predictions that all peers of a run together may ask for, over its socket and DDS: so many at
/// once, then so many a second. Each costs one cycle a copy. Controllers are not counted.
inline constexpr std::int64_t kPredictionsPerSecond = 10;

/// Adds "predict", which refuses more than kPredictionsPerSecond.
/// @param service  null: the run has no model of its robot, which is the answer
/// @param now_ns   a clock that does not go back; empty: CLOCK_MONOTONIC
void add_predict(ControlRegistry& registry, internal_model::PredictionService* service,
                 const hal::RobotConfig& robot, std::function<std::int64_t()> now_ns = {});

}  // namespace tandem::apps
