// What a robot.toml says about the settings of a joint's drive.
// Layer: hal/config.  Thread: any, non-RT.
#pragma once

#include "canopen/drive_parameters.hpp"
#include "hal/config/robot_config.hpp"

namespace tandem::hal {

/// NaN: it says nothing, and the drive keeps its own. The drive master writes this to our boards,
/// and an emulated board has it at power-on.
[[nodiscard]] canopen::DriveParameters drive_parameters(const RobotConfig& robot,
                                                        const JointConfig& joint);

}  // namespace tandem::hal
