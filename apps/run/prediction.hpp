// The command that asks a run for a prediction.
// Layer: apps/run.  Thread: main; the command runs on the serving thread.
#pragma once

#include <cstdint>
#include <functional>

#include "apps/control/control_registry.hpp"
#include "hal/config/robot_config.hpp"
#include "internal_model/prediction_service.hpp"

namespace tandem::apps {

/// Predictions that all peers of a run together may ask for, over its socket and DDS: so many at
/// once, then so many a second. Each costs one cycle a copy. Controllers are not counted.
inline constexpr std::int64_t kPredictionsPerSecond = 10;

/// Adds "predict", which refuses more than kPredictionsPerSecond.
/// @param service  null: the run has no model of its robot, which is the answer
/// @param now_ns   a clock that does not go back; empty: CLOCK_MONOTONIC
void add_predict(ControlRegistry& registry, internal_model::PredictionService* service,
                 const hal::RobotConfig& robot, std::function<std::int64_t()> now_ns = {});

}  // namespace tandem::apps
