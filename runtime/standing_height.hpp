// How high a robot's base is when it stands.
// Layer: runtime.  Thread: non-RT only.
#pragma once

#include "hal/robot_config.hpp"
#include "model/tree.hpp"

namespace tandem::runtime {

/// The height of an upright floating base's origin above W's at which the lowest point of the
/// feet touches the ground in this posture. Feet on links that the description lacks are passed
/// over; 0 without any.
[[nodiscard]] double standing_height_m(const hal::RobotConfig& robot,
                                       const hal::PostureConfig& posture, const model::Tree& tree);

}  // namespace tandem::runtime
