// A point-to-point motion with bounded speed and acceleration, one step at a time.
// Layer: hal.  Thread: any.
#pragma once

#include "base/realtime.hpp"

namespace tandem::hal {

/// Where a joint's reference is on its way. A new target, speed or acceleration may come at any
/// time; the velocity stays continuous.
struct Trapezoid {
  double position_rad = 0.0;
  double velocity_rad_s = 0.0;

  /// Moves on by `dt_s` towards `target_rad`, at rest there.
  /// @param speed_rad_s, acceleration_rad_s2  greater than 0.
  /// @return true once the reference rests at the target (exactly).
  bool step(double target_rad, double speed_rad_s, double acceleration_rad_s2,
            double dt_s) noexcept TANDEM_RT;

  /// Brings the velocity to `target_rad_s` within the acceleration, and moves on.
  void run(double target_rad_s, double acceleration_rad_s2, double dt_s) noexcept TANDEM_RT;
};

}  // namespace tandem::hal
