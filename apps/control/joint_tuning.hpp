// Gains and impedances of a running robot as its robot.toml takes them.
// Layer: apps/control.  Thread: any.
#pragma once

#include <string>
#include <vector>

#include "hal/config/robot_config.hpp"
#include "runtime/run_services.hpp"

namespace tandem::apps {

/// The loops of a robot's drives as they are now.
struct Tuning {
  std::string toml;                  ///< [gains.NAME] tables, in place of the robot.toml's
  std::vector<std::string> changed;  ///< joints with another gain or impedance than the robot.toml
};

/// Joints that shared a table and now differ have tables of their own, and a comment that says
/// which `gains` their [[joint]] is to have.
/// @param joints  every joint of the robot, in its order
[[nodiscard]] Tuning tuning_of(const hal::RobotConfig& robot,
                               const std::vector<runtime::JointInfo>& joints);

}  // namespace tandem::apps
