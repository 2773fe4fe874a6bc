// Whether a loop of a joint's drive is stable, and by how much: motor, spring and link with the
// board's law, sampled at its control period.
// Layer: robot.  Thread: any; pure.
#pragma once

#include <limits>
#include <span>

#include "hal/config/robot_config.hpp"

namespace tandem::robot {

/// One loop of one joint, of our own boards. Linear: limits of voltage, current and torque, gravity
/// and the ground are not looked at, nor what other joints' loops do.
struct LoopPlant {
  hal::PidLoop loop = hal::PidLoop::kPosition;  ///< the mode that is judged; not the current's
  const hal::ActuatorConfig& actuator;
  const hal::GainsConfig& gains;  ///< of this loop and of the torque loop inside it
  double period_s = 0.0;          ///< of the board's control
};

/// What a loop has, with one of the inertias that it was asked about.
struct LoopVerdict {
  hal::PidLoop loop = hal::PidLoop::kPosition;
  double inertia_kg_m2 = 0.0;
  double growth = 0.0;  ///< the largest magnitude of its eigenvalues: by so much it grows a period
  double period_s = 0.0;
  /// Phase margin of the loop, opened at its own output: the torque reference (position, velocity)
  /// or the torque loop's voltage. The least, where the gain is 1 more than once. NaN: it is
  /// unstable, or its gain is 1 nowhere.
  double phase_margin_deg = std::numeric_limits<double>::quiet_NaN();
  double crossover_rad_s = std::numeric_limits<double>::quiet_NaN();

  /// It doubles in seven seconds or more, if at all: a torque loop about a free link that turns on
  /// does so, whose back-EMF is compensated.
  [[nodiscard]] bool stable() const;
  /// It is unstable and grows faster, or has less margin.
  [[nodiscard]] bool worse_than(const LoopVerdict& other) const;
};

/// The worst of some inertias: the unstable one that grows fastest, else the least margin.
///
/// @param inertias_kg_m2  of the link, with the rotor where the drive has no spring
/// @param with_margin  false: stable or not, which takes a hundredth of the time
/// @pre inertias_kg_m2 is not empty; each above 0
[[nodiscard]] LoopVerdict judge_loop(const LoopPlant& plant, std::span<const double> inertias_kg_m2,
                                     bool with_margin = true);

}  // namespace tandem::robot
