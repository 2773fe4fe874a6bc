// Whether what a joint asks of its drive is what the drive's numbers can say.
// Layer: hal/config.  Thread: any, non-RT.
#pragma once

#include "base/result.hpp"
#include "hal/config/robot_config.hpp"

namespace tandem::hal {

/// Positions travel as counts of 32 bits: the largest one, with a margin for overshoot.
inline constexpr double kMostCounts = 0.9 * 2147483647.0;

/// Counts of which a revolution or the joint's range has more than 32 bits take, homing that is
/// faster than the joint, slower than its counts or far outside of its range, a method or stop
/// option beyond what the drive's sheet takes, velocities that its 32 bits cannot say. Each with
/// file, line, key and joint.
/// @pre the joint's limits are known (complete_from_description())
[[nodiscard]] Diagnostics check_drive_ranges(const RobotConfig& robot, const JointConfig& joint);

}  // namespace tandem::hal
