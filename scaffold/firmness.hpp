// Whether a robot on its feet is held firmly enough not to fall over.
// Layer: scaffold.  Thread: any, non-RT.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "scaffold/new_robot.hpp"

namespace tandem::scaffold {

/// The stiffness [Nm/rad or N/m] that a drive's position loop gives its joint before its integral
/// has begun: kp, in series with the spring where the loop is closed on the motor.
[[nodiscard]] double held_stiffness(const hal::ActuatorConfig& drive,
                                    const hal::GainsConfig& gains);

/// How many times as stiff all joints together would have to be for the robot to stand still: below
/// 1 it does. Gravity bends joints and ground until they carry it, to first order: the inverted
/// pendulum over ankles, knees, hips and trunk in series, sagittal and lateral, on soles that press
/// into the ground. There the energy must have a minimum in the base's six directions and in every
/// joint, and the ground must press on every contact point: where it does not, the weight has left
/// the soles and the robot tips. At first every point carries the same share; none slips.
///
/// It says nothing of motion: a robot that stands by this may still be thrown over when it is let
/// down, or sway for long. No torque limit, and no integral, which is slow.
/// @param q  (joints) the posture, in the tree's order
/// @return 0.01 to 100; empty: not even the stiffest stand, so it is not for the drives to say
/// @pre the ground is filled
[[nodiscard]] std::optional<double> needed_firmness(const NewRobot& robot,
                                                    const Eigen::VectorXd& q);

/// A warning, with what the softest leg joint has and would need and what to do, when the robot
/// would fall over.
[[nodiscard]] std::optional<Error> falls_over(const NewRobot& robot, const Eigen::VectorXd& q);

}  // namespace tandem::scaffold
