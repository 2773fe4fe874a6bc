// Whether drives are strong enough for what hangs on them.
// Layer: scaffold.  Thread: any, non-RT.
#pragma once

#include "scaffold/new_robot.hpp"

namespace tandem::scaffold {

/// The most that a joint can give at rest [Nm or N]: its command limit, or what its drive's
/// limits of current and voltage leave.
[[nodiscard]] double strength_of(const hal::JointConfig& joint, const hal::ActuatorConfig& drive);

/// What it can give for long: at the continuous current, where the drive watches that.
[[nodiscard]] double lasting_strength_of(const hal::JointConfig& joint,
                                         const hal::ActuatorConfig& drive);

/// A warning for each joint that cannot hold the posture `torques` belong to, with what to do.
/// @param torques  (joints) of torques_at(), in the tree's order
[[nodiscard]] Diagnostics weak_drives(const NewRobot& robot, const std::vector<double>& torques);

}  // namespace tandem::scaffold
