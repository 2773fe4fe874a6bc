// Closed loops, as `tandem check` shows them.
// Layer: apps/robot.  Thread: main.
#pragma once

#include "apps/text/console.hpp"
#include "robot/closure_study.hpp"

namespace tandem::apps {

void add_loop_facts(const hal::RobotConfig& robot, const robot::ClosureStudy& study, Facts& facts);

/// `loops`, `loop_postures` and `freedom` of docs/json.md.
void add_loop_json(const hal::RobotConfig& robot, const robot::ClosureStudy& study, Json& json);

}  // namespace tandem::apps
