// Where a robot's joints are to go so that one of its sites goes a small step.
// Layer: robot.  Thread: any; not the loop's.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "hal/config/robot_config.hpp"
#include "model/kernels.h"

namespace tandem::robot {

struct SiteStep {
  std::string site;
  std::size_t axis = 0;  ///< 0 to 5: along x, y, z, about x, y, z
  bool own = false;      ///< axes of the site; else of the base
  double by = 0.0;       ///< [m, of an angle rad]
};
struct SteppedJoints {
  std::vector<std::size_t> joints;  ///< of the robot: those that lead the site
  std::vector<double> target_rad;   ///< of each [rad, of a slide m]
};

/// By damped least squares, on the model's Jacobian, until the site is there. With six joints or
/// more what the step does not name stays: the site's direction, or its place.
/// @param kernels  null: there is no model
/// @param from_rad  of every joint of the robot
/// Errors: there is no model; closed loops; no such site (with the nearest); a step that these
/// joints do not make, as near a singular posture; a joint that would be beyond its limits.
[[nodiscard]] Result<SteppedJoints> site_step(const hal::RobotConfig& robot,
                                              const tandem_kernels* kernels, const SiteStep& step,
                                              std::span<const double> from_rad);

}  // namespace tandem::robot
