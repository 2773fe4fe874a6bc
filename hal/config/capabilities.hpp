// What a robot's configuration lets its joints do, and what of it a controller may know: computed
// once.
// Layer: hal.  Thread: non-RT.
#pragma once

#include <vector>

#include "base/result.hpp"
#include "hal/config/robot_config.hpp"
#include "hal/image.hpp"
#include "hal/joint_capabilities.hpp"
#include "hal/robot.hpp"

namespace tandem::hal {

/// What of the configuration is the controllers' to know. @pre  the joints' limits are known
[[nodiscard]] Robot robot_of(const RobotConfig& config);

/// @pre  the joint's limits are known
[[nodiscard]] JointCapabilities capabilities_of(const RobotConfig& robot, const JointConfig& joint);

/// Capabilities of every joint, in the image's order.
[[nodiscard]] std::vector<JointCapabilities> joint_capabilities(const RobotConfig& robot);

/// What a joint's drive tells besides the joint's position; its velocity then follows from that.
struct MotorFeedback {
  bool position = true;  ///< the motor's own
  bool torque = true;
  bool current = true;
  bool voltage = true;
  bool temperature = true;
};
/// Feedback of every joint, as the data sheets of the drives say.
[[nodiscard]] std::vector<MotorFeedback> motor_feedback(const RobotConfig& robot);

/// Whether a joint can be put into a mode; asked for every claim at configuration.
/// @return an Error that names the joint, the mode and the gains table that lacks a loop.
[[nodiscard]] Status check_capability(const RobotConfig& robot, std::size_t joint, ControlMode mode,
                                      InteractionMode interaction = InteractionMode::kStiff);

/// The gains that bring-up gives the drives, as the parameters at revision 0.
[[nodiscard]] ParameterImage initial_parameters(const RobotConfig& robot);

}  // namespace tandem::hal
