// move.toml: a motion of every joint that is safe to begin with.
// Layer: scaffold.  Thread: non-RT.
#pragma once

#include "scaffold/new_robot.hpp"
#include "scaffold/standing.hpp"

namespace tandem::scaffold {

/// Every joint to one side of its posture, to the other and back, as far as drives of `robot` can
/// carry and accelerate what hangs on them.
/// @pre  `robot` has its joints and drives
[[nodiscard]] Move swing(const NewRobot& robot, const Eigen::VectorXd& posture);

/// The same for what is no leg, while the legs lower the robot twice and keep its centre of mass
/// over the feet.
[[nodiscard]] Move squat_and_swing(const NewRobot& robot, const Standing& standing);

}  // namespace tandem::scaffold
