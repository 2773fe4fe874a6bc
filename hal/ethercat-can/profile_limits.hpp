// What a drive's own ramps may be where it moves in profile modes: its joint's limits.
// Layer: hal/ethercat-can.  Thread: any; of() non-RT.
#pragma once

#include <algorithm>
#include <cmath>

#include "base/realtime.hpp"
#include "hal/config/robot_config.hpp"

namespace tandem::hal::can {

struct ProfileLimits {
  double velocity_rad_s = 0.0;
  double acceleration_rad_s2 = 0.0;  ///< and deceleration
  double min_position_rad = 0.0;
  double max_position_rad = 0.0;

  [[nodiscard]] static ProfileLimits of(const JointConfig& joint) {
    constexpr double kFullSpeed_s = 0.1;  // of a joint that declares no acceleration
    const double most = joint.max_acceleration_rad_s2;
    return {
        .velocity_rad_s = joint.max_velocity_rad_s,
        .acceleration_rad_s2 = std::isfinite(most) ? most : joint.max_velocity_rad_s / kFullSpeed_s,
        .min_position_rad = joint.min_position_rad,
        .max_position_rad = joint.max_position_rad};
  }

  /// The way from `position_rad` on which a joint of this speed brakes, within its range.
  [[nodiscard]] double braking_way_rad(double position_rad,
                                       double speed_rad_s) const noexcept TANDEM_RT {
    if (!(acceleration_rad_s2 > 0.0)) return 0.0;
    const double speed = std::clamp(speed_rad_s, -velocity_rad_s, velocity_rad_s);
    const double way = 0.5 * speed * std::abs(speed) / acceleration_rad_s2;
    return way > 0.0 ? std::min(way, std::max(0.0, max_position_rad - position_rad))
                     : std::max(way, std::min(0.0, min_position_rad - position_rad));
  }
};

}  // namespace tandem::hal::can
