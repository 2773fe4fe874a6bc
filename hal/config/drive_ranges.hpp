// Whether what a joint asks of its drive is what the drive's numbers can say.
// Layer: hal/config.  Thread: any, non-RT.
#pragma once

#include "base/result.hpp"
#include "hal/config/robot_config.hpp"

namespace tandem::hal {

/// Homing that is faster than the joint, slower than its counts or far outside of its range, a
/// method or stop option beyond what the drive's sheet takes, velocity units that its 32 bits
/// cannot say. Each with file, line, key and joint.
/// @pre the joint's limits are known (complete_from_description())
[[nodiscard]] Diagnostics check_drive_ranges(const RobotConfig& robot, const JointConfig& joint);

}  // namespace tandem::hal
