// Joints that follow others, as messages of joint states have them.
// Layer: dds.  Thread: any, non-RT.
#pragma once

#include <vector>

#include "hal/config/robot_config.hpp"
#include "hal/follower.hpp"
#include "model/tree.hpp"

namespace tandem::dds {

/// Those of the description that follow a joint of the image.
[[nodiscard]] std::vector<hal::Follower> followers_of(const hal::RobotConfig& robot,
                                                      const model::Tree& tree);

}  // namespace tandem::dds
