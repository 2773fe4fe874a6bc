// What a joint can give with the drive that it has.
// Layer: hal/config.  Thread: any, non-RT.
#pragma once

#include "hal/config/robot_config.hpp"

namespace tandem::hal {

/// The most that a joint can give at rest [Nm or N]: its command limit, or what its drive's
/// limits of current and voltage leave.
[[nodiscard]] double strength_of(const JointConfig& joint, const ActuatorConfig& drive);

/// What it can give for long: at the continuous current, where the drive watches that.
[[nodiscard]] double lasting_strength_of(const JointConfig& joint, const ActuatorConfig& drive);

}  // namespace tandem::hal
