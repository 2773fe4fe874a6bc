// Position loops that will probably oscillate, at the period in which their boards compute them.
// Layer: apps/robot.  Thread: main.
#pragma once

#include <optional>
#include <string>

#include "apps/robot/robot_files.hpp"

namespace tandem::apps {

/// A joint's position loop, of our own boards: motor, spring and link, linear, with the board's
/// gains and velocity estimates, sampled at its control period. Of drives of other makers nothing
/// is known.
///
/// @param inertia_kg_m2  of the link, with the rotor where the drive has no spring
/// @return the largest magnitude of its eigenvalues: above 1 it is unstable
[[nodiscard]] double loop_growth(const hal::ActuatorConfig& actuator, const hal::GainsConfig& gains,
                                 double inertia_kg_m2, double period_s);

/// The joints whose position loop grows by 2 % or more in a period in a posture, both with every
/// other joint locked and with all of them and the base free. Limits of voltage and current, the
/// integral and the ground are not looked at. Nothing of closed loops.
///
/// @param posture  empty: every joint at 0
/// @return  one warning for all of them, at the line of the joint that grows fastest
[[nodiscard]] std::optional<Error> ringing_loops(const RobotFiles& robot,
                                                 const std::string& posture);

}  // namespace tandem::apps
