// Position and velocity loops that will probably oscillate, at the period in which their boards
// compute them.
// Layer: apps/robot.  Thread: main.
#pragma once

#include <optional>
#include <string>

#include "apps/robot/robot_files.hpp"

namespace tandem::apps {

/// The joints whose position or velocity loop is unstable in a posture or elsewhere in its range:
/// GainsJudge, which says what is looked at.
///
/// @param posture  empty: every joint at 0
/// @return  one warning for all of them, at the line of the joint that grows fastest
[[nodiscard]] std::optional<Error> ringing_loops(const RobotFiles& robot,
                                                 const std::string& posture);

}  // namespace tandem::apps
