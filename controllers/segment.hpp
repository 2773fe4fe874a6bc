// A quintic piece of a trajectory between two way-points.
// Layer: controllers.  Thread: any.
#pragma once

#include "base/realtime.hpp"

namespace tandem {

/// Position, velocity and acceleration at one instant.
struct Motion {
  double position = 0.0;
  double velocity = 0.0;
  double acceleration = 0.0;
};

/// The fifth-order polynomial that meets position and velocity at both ends, with zero
/// acceleration there. At rest at both ends it is the minimum-jerk profile.
///
/// @param t_s  0 to duration_s
[[nodiscard]] inline Motion quintic(const Motion& from, const Motion& to, double duration_s,
                                    double t_s) noexcept TANDEM_RT {
  const double T = duration_s;
  const double x = t_s / T;
  const double way = to.position - from.position;
  const double v0 = from.velocity * T;
  const double v1 = to.velocity * T;
  const double a3 = 10.0 * way - 6.0 * v0 - 4.0 * v1;
  const double a4 = -15.0 * way + 8.0 * v0 + 7.0 * v1;
  const double a5 = 6.0 * way - 3.0 * (v0 + v1);
  return {from.position + x * (v0 + x * x * (a3 + x * (a4 + x * a5))),
          (v0 + x * x * (3.0 * a3 + x * (4.0 * a4 + x * 5.0 * a5))) / T,
          x * (6.0 * a3 + x * (12.0 * a4 + x * 20.0 * a5)) / (T * T)};
}

}  // namespace tandem
