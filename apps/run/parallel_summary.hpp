// What a second robot beside the first amounts to: for the JSON file and the table at the end.
// Layer: apps/run.  Thread: main.
#pragma once

#include <cstdio>

#include "apps/text/console.hpp"
#include "hal/config/robot_config.hpp"
#include "internal_model/parallel_robot.hpp"

namespace tandem::apps {

/// docs/json.md, "parallel"
[[nodiscard]] Json parallel_json(const hal::RobotConfig& second,
                                 const internal_model::ParallelResult& result,
                                 const internal_model::Differences& differences);

/// The joints and sensors that differ most, or that nothing does.
void print_parallel(const hal::RobotConfig& second, const internal_model::ParallelResult& result,
                    const internal_model::Differences& differences, std::FILE* out);

}  // namespace tandem::apps
