// How far a joint may be from its reference, where its table does not say.
// Layer: hal/config.  Thread: any.
#pragma once

#include <algorithm>
#include <cmath>

#include "hal/config/robot_config.hpp"

namespace tandem::hal {

/// [m] of a joint that slides: 0.5, a joint's that turns, is more than many slides can go, so that
/// nothing would ever be found. It is the way of 0.1 s at its maximum velocity, as of drives with a
/// data sheet, and at most half its travel.
/// @param joint  with its limits; those that are not finite do not count
[[nodiscard]] inline double slide_following_error_m(const JointConfig& joint) {
  constexpr double kLag_s = 0.1;
  double error_m = JointConfig{}.following_error_rad;
  const double travel_m = joint.max_position_rad - joint.min_position_rad;
  if (std::isfinite(travel_m) && travel_m > 0.0) error_m = std::min(error_m, 0.5 * travel_m);
  const double way_m = kLag_s * joint.max_velocity_rad_s;
  if (std::isfinite(way_m) && way_m > 0.0) error_m = std::min(error_m, way_m);
  return error_m;
}

}  // namespace tandem::hal
