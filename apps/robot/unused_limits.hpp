// Limits of a description that its robot.toml goes beyond.
// Layer: apps/robot.  Thread: main.
#pragma once

#include "base/result.hpp"
#include "hal/config/robot_config.hpp"
#include "model/tree.hpp"

namespace tandem::apps {

/// At most one warning of soft limits (<safety_controller>) and one of accelerations and jerks: the
/// URDF's are limits only where robot.toml has them.
/// @param robot  completed from the description
[[nodiscard]] Diagnostics unused_limits(const hal::RobotConfig& robot, const model::Tree& tree);

}  // namespace tandem::apps
