// What the bundled controllers' parameters have in common.
// Layer: controllers.  Thread: non-RT only.
#pragma once

#include <string_view>
#include <vector>

#include "controllers/controller.hpp"
#include "hal/capabilities.hpp"

namespace tandem {

/// `joints = [names]`: indices in the image, every joint of the robot when the key is missing.
/// A name that the robot lacks, or that stands twice, is reported at the key and left out.
[[nodiscard]] std::vector<std::size_t> joints_parameter(ControllerSetup& setup);

/// The robot's joint names in the image's order.
[[nodiscard]] std::vector<std::string> joint_names(const hal::RobotConfig& robot);

/// `posture = "name"`: null when the key is missing or names none (then it is reported).
[[nodiscard]] const hal::PostureConfig* posture_parameter(ControllerSetup& setup);

/// Claims a joint in a mode that it can do. @return check_capability()'s error otherwise.
[[nodiscard]] Status claim(ControllerSetup& setup, std::size_t joint, hal::ControlMode mode,
                           hal::InteractionMode interaction = hal::InteractionMode::kStiff);

}  // namespace tandem
