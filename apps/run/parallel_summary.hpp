// What a second robot beside the first amounts to: for the JSON file and the table at the end.
// Layer: apps/run.  Thread: main.
#pragma once

#include <cstdio>

#include "apps/text/figures.hpp"
#include "hal/config/robot_config.hpp"
#include "internal_model/parallel_robot.hpp"

namespace tandem::apps {

struct ParallelSummary {
  const hal::RobotConfig* second = nullptr;
  const internal_model::ParallelResult* result = nullptr;
  const internal_model::Differences* all = nullptr;
};

void figures(Figures& f, const ParallelSummary& s);

/// The joints and sensors that differ most, or that nothing does.
void print_parallel(const ParallelSummary& summary, std::FILE* out);

}  // namespace tandem::apps
