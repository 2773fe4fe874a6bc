// Whether a posture starts inside the ground.
// Layer: apps/robot.  Thread: main.
#pragma once

#include <optional>
#include <string>

#include "apps/robot/robot_files.hpp"

namespace tandem::apps {

/// A posture whose lowest point of a sole is inside the ground: by more than 5 mm, and by more than
/// twice what the robot's weight presses its soles in. The hoist can lower a robot to the ground,
/// but not lift it out. Or one that starts higher above the ground than ten times the height at
/// which it touches: a slip of units.
///
/// @param posture  empty: every joint at 0
/// @return  the error, with the posture's line and the base_height_m that lets the lowest point
///          touch; nothing when the posture is right or unknown, or the robot has no [contact]
[[nodiscard]] std::optional<Error> wrong_start_height(const RobotFiles& robot,
                                                      const std::string& posture);

/// Links besides the soles' whose collision shapes are inside the ground in this posture, one
/// warning each; none of guessed shapes. Empty without [contact].
[[nodiscard]] Diagnostics buried_links(const RobotFiles& robot, const std::string& posture);

}  // namespace tandem::apps
