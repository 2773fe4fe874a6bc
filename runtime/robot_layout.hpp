// Whether one robot can get the commands of another.
// Layer: runtime.  Thread: non-RT only.
#pragma once

#include <string>

#include "hal/config/robot_config.hpp"

namespace tandem::runtime {

/// Why the robot `second` cannot get the commands of `first`, in words, with the names; empty: it
/// can. The two have the same joints, sensors with the same channels, and feet, in the same order.
[[nodiscard]] std::string layout_difference(const hal::RobotConfig& first,
                                            const hal::RobotConfig& second);

}  // namespace tandem::runtime
