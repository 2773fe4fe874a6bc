// What each joint has to move and to hold, over the postures that it can be in.
// Layer: scaffold.  Thread: any, non-RT.
#pragma once

#include <string>
#include <vector>

#include "scaffold/feet.hpp"
#include "scaffold/posed.hpp"
#include "scaffold/posture.hpp"

namespace tandem::scaffold {

/// [kg m^2, Nm] of a revolute joint, [kg, N] of one that slides; without the rotor.
struct JointLoad {
  double least_inertia = 0.0;  ///< smallest and largest diagonal entry of M
  double most_inertia = 0.0;   ///< a leg's: at least what it swings when its foot stands
  double free_inertia = 0.0;   ///< the largest with its foot in the air
  double gravity_Nm = 0.0;     ///< the most that gravity asks for
  double sway_inertia = 0.0;   ///< a leg's: what sways about the sole when nothing else gives way
  double sway_Nm_rad = 0.0;    ///< what keeps that from falling
  double stand_Nm = 0.0;       ///< a leg's: what it bears in the standing posture
  double fall_Nm_rad = 0.0;    ///< a leg's: what keeps the inverted pendulum on it from falling
};

/// @param stance  the standing posture; null: the base is fixed
[[nodiscard]] std::vector<JointLoad> loads_of(const model::Tree& tree,
                                              const std::vector<FoundFoot>& feet,
                                              const Posed* stance);

/// The limits that drives are made for.
struct JointLimits {
  double effort = 0.0;    ///< [Nm or N]
  double velocity = 0.0;  ///< [rad/s or m/s]
  bool effort_guessed = false;
  bool velocity_guessed = false;
  PositionRange range;
};

/// What each joint gives at one posture at rest [Nm or N], positive about its axis: against the
/// weight that hangs on it, less what the ground carries, on every foot the same share. 0 for a
/// follower; its leader's has it.
/// @param feet  empty: the base is fixed
[[nodiscard]] std::vector<double> torques_at(const model::Tree& tree,
                                             const std::vector<FoundFoot>& feet,
                                             const Posed& posed);

/// The description's, where they can be: a limit of zero, or far beyond what the robot's weight
/// at its full reach could use, is none. An effort is then taken from the load: twice gravity at
/// its worst and 10 rad/s^2 of the largest inertia on top, and no less than a quarter of
/// what its neighbours in the tree have.
[[nodiscard]] std::vector<JointLimits> limits_of(const model::Tree& tree,
                                                 const std::vector<JointLoad>& loads);

/// A sentence on the description's figures that limits_of() has not used, beyond all that a robot
/// has; empty: there are none.
[[nodiscard]] std::string replaced_limits(const model::Tree& tree,
                                          const std::vector<JointLimits>& limits);

}  // namespace tandem::scaffold
