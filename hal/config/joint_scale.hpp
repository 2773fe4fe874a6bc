// Whether the scale of a joint on a drive of another make can be what the drive's sheet says.
// Layer: hal/config.  Thread: any, non-RT.
#pragma once

#include "base/result.hpp"
#include "hal/config/robot_config.hpp"

namespace tandem::hal {

/// A scale that the sheet cannot tell: it counts revolutions, and the joint slides. Each with file,
/// line, key and joint.
/// @pre it is known whether the joint slides (complete_from_description())
[[nodiscard]] Diagnostics check_joint_scale(const RobotConfig& robot, const JointConfig& joint);

}  // namespace tandem::hal
