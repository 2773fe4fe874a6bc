// A quintic piece of a trajectory between two way-points.
// Layer: controllers.  Thread: any.
#pragma once

#include "base/realtime.hpp"

namespace tandem {

/// Position, velocity and acceleration at one instant.
struct TrajectoryPoint {
  double position = 0.0;
  double velocity = 0.0;
  double acceleration = 0.0;
};

/// The fifth-order polynomial that meets position and velocity at both ends, with zero
/// acceleration there. At rest at both ends it is the minimum-jerk profile.
///
/// @param t_s  0 to duration_s
[[nodiscard]] inline TrajectoryPoint quintic(const TrajectoryPoint& from, const TrajectoryPoint& to,
                                             double duration_s, double t_s) noexcept TANDEM_RT {
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

/// The same with the accelerations of both ends: what a planner's points say.
[[nodiscard]] inline TrajectoryPoint quintic_through(const TrajectoryPoint& from,
                                                     const TrajectoryPoint& to, double duration_s,
                                                     double t_s) noexcept TANDEM_RT {
  const double T = duration_s;
  const double x = t_s / T;
  const double a0 = from.acceleration * T * T / 2.0, a1 = to.acceleration * T * T / 2.0;
  const TrajectoryPoint bent{a0, 2.0 * a0 / T,
                             0.0};  // at the end, of a0 x^2, whose rest quintic() makes
  const TrajectoryPoint rest =
      quintic({from.position, from.velocity, 0.0},
              {to.position - bent.position, to.velocity - bent.velocity, 0.0}, T, t_s);
  // x^3 (x - 1)^2 is at rest at both ends, and its acceleration is 2 at the second.
  const double y = x - 1.0, b = a1 - a0;
  return {rest.position + a0 * x * x + b * x * x * x * y * y,
          rest.velocity + (2.0 * a0 * x + b * x * x * y * (5.0 * x - 3.0)) / T,
          rest.acceleration + (2.0 * a0 + b * (x * (20.0 * x * x - 24.0 * x + 6.0))) / (T * T)};
}

/// The third-order polynomial that meets position and velocity at both ends.
[[nodiscard]] inline TrajectoryPoint cubic(const TrajectoryPoint& from, const TrajectoryPoint& to,
                                           double duration_s, double t_s) noexcept TANDEM_RT {
  const double T = duration_s;
  const double x = t_s / T;
  const double way = to.position - from.position;
  const double v0 = from.velocity * T, v1 = to.velocity * T;
  const double a2 = 3.0 * way - 2.0 * v0 - v1, a3 = v0 + v1 - 2.0 * way;
  return {from.position + x * (v0 + x * (a2 + x * a3)), (v0 + x * (2.0 * a2 + x * 3.0 * a3)) / T,
          (2.0 * a2 + x * 6.0 * a3) / (T * T)};
}

}  // namespace tandem
