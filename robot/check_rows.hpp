// The checks that are too long for their table, robot/check.cpp.
// Layer: robot.  Thread: main.
#pragma once

#include "model/kernels.h"
#include "robot/check.hpp"

namespace tandem::robot {

/// What a check looks at.
struct CheckedRobot {
  const RobotFiles& robot;
  const RobotUse& use;
  const tandem_kernels& kernels;  ///< interpreted from the description
};

/// Postures whose lowest point of a sole is inside the ground: by more than 5 mm, and by more than
/// twice what the robot's weight presses its soles in. The hoist can lower a robot to the ground,
/// but not lift it out. Or which start higher above the ground than ten times the height at which
/// they touch: a slip of units. The hint is the base_height_m that lets the lowest point touch.
void check_start_heights(const CheckedRobot& subject, Findings& findings);

/// Links besides the soles' whose collision shapes are inside the ground, one warning each; none of
/// guessed shapes.
void check_buried_links(const CheckedRobot& subject, Findings& findings);

/// Joints that cannot give the torque that gravity asks of them at rest: their max_torque_Nm, or
/// what current and voltage leave of it, is less. Joints between the base and a foot are left out,
/// for what the ground carries is not known, and so are closed loops. One warning a posture, at the
/// line of the weakest.
void check_torques(const CheckedRobot& subject, Findings& findings);

/// Joints whose position or velocity loop is unstable in the first posture or elsewhere in its
/// range: GainsJudge, which says what is looked at. One warning for all of them, at the line of the
/// joint that grows fastest.
void check_gains(const CheckedRobot& subject, Findings& findings);

/// At most one warning of soft limits (<safety_controller>) and one of accelerations and jerks: the
/// URDF's are limits only where robot.toml has them.
void check_unused_limits(const CheckedRobot& subject, Findings& findings);

}  // namespace tandem::robot
