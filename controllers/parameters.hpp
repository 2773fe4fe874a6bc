// What the bundled controllers' parameters have in common.
// Layer: controllers.  Thread: non-RT only.
#pragma once

#include <string>
#include <vector>

#include "controllers/controller.hpp"

namespace tandem {

/// `joints = [names]`: indices in the image, every joint of the robot when the key is missing.
/// A name that the robot lacks, or that stands twice, is reported at the key and left out.
[[nodiscard]] std::vector<std::size_t> joints_parameter(ControllerSetup& setup);

/// The robot's joint names in the image's order.
[[nodiscard]] std::vector<std::string> joint_names(const hal::Robot& robot);

/// `link_damping_Nms_rad`: live, 0 where the key is missing.
[[nodiscard]] Parameter link_damping_parameter(ControllerSetup& setup);

/// `stop_at_end`: live, false where the key is missing.
[[nodiscard]] Parameter stop_at_end_parameter(ControllerSetup& setup);

/// `posture = "name"`: null when the key is missing or names none (then it is reported).
[[nodiscard]] const hal::Posture* posture_parameter(ControllerSetup& setup);

}  // namespace tandem
