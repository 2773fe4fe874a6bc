// Whether the scale of a joint on a drive of another make can be what the drive's sheet says, and
// what of the sheet contradicts it. Layer: hal/config.  Thread: any, non-RT.
#pragma once

#include "base/result.hpp"
#include "hal/config/robot_config.hpp"

namespace tandem::hal {

/// A scale that the sheet cannot tell: it counts revolutions, and the joint slides; a polarity
/// (607E) of positions and not of velocities, or the reverse. Each with file, line, key and joint.
/// @pre it is known whether the joint slides (complete_from_description())
[[nodiscard]] Diagnostics check_joint_scale(const RobotConfig& robot, const JointConfig& joint);

/// What speaks against the scale that a joint was given: values of its sheet that change the
/// meaning of positions and velocities, where robot.toml does not say itself what is right; a scale
/// of robot.toml that is more than 1 % off the sheet's; and one that our own boards have to round.
/// Joints of which the same is true share a warning.
/// @pre as above
[[nodiscard]] Diagnostics scale_warnings(const RobotConfig& robot);

}  // namespace tandem::hal
