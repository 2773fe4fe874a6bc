// What each joint has to move and to hold, over the postures that it can be in.
// Layer: scaffold.  Thread: any, non-RT.
#pragma once

#include <vector>

#include "scaffold/feet.hpp"
#include "scaffold/posed.hpp"
#include "scaffold/posture.hpp"

namespace tandem::scaffold {

/// [kg m^2, Nm] of a revolute joint, [kg, N] of one that slides; without the rotor.
struct JointLoad {
  double least_inertia = 0.0;  ///< smallest and largest diagonal entry of M
  double most_inertia = 0.0;   ///< a leg's: at least what it swings when its foot stands
  double gravity_Nm = 0.0;     ///< the most that gravity asks for
  double fall_Nm_rad = 0.0;    ///< a leg's: what keeps the inverted pendulum on it from falling
};

/// @param stance  the standing posture; null: the base is fixed
[[nodiscard]] std::vector<JointLoad> loads_of(const model::Tree& tree,
                                              const std::vector<Foot>& feet, const Posed* stance);

/// The limits that drives are made for.
struct JointLimits {
  double effort = 0.0;    ///< [Nm or N]
  double velocity = 0.0;  ///< [rad/s or m/s]
  bool effort_guessed = false;
  bool velocity_guessed = false;
  PositionRange range;
};

/// The description's, where they can be: a limit of zero, or far beyond what the robot's weight
/// at its full reach could use, is none, and is taken from the load.
[[nodiscard]] std::vector<JointLimits> limits_of(const model::Tree& tree,
                                                 const std::vector<JointLoad>& loads);

}  // namespace tandem::scaffold
