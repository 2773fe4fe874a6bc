// Right angles that a description writes with few digits, for `model info` and `new`.
// Layer: apps/tools.  Thread: main.
#pragma once

#include "apps/text/console.hpp"
#include "robot/robot_files.hpp"

namespace tandem::apps {

/// Adds how many there are, what they cost in forward dynamics, and how far exact ones would move
/// the robot; nothing when there are none, and no facts when exact ones save nothing. Generates the
/// dynamics both ways, and compiles nothing.
///
/// Errors: those of robot::with_description() and of model::count_kernel().
[[nodiscard]] Status add_right_angles(const robot::RobotFiles& robot, Facts& facts, Json& json);

}  // namespace tandem::apps
