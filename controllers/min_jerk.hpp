// The minimum-jerk profile: the smoothest rest-to-rest motion in a given time.
// Layer: controllers.  Thread: any.
#pragma once

#include "base/realtime.hpp"

namespace tandem {

/// A profile's share of its way, and its first and second derivative by its share of the time.
struct MinJerk {
  double s = 0.0;    ///< 0 to 1
  double ds = 0.0;   ///< ds/dx, at most 1.875
  double dds = 0.0;  ///< d2s/dx2
};

/// s(x) = 10 x^3 - 15 x^4 + 6 x^5, at rest outside 0 <= x <= 1 (Flash and Hogan 1985).
[[nodiscard]] inline MinJerk min_jerk(double x) noexcept TANDEM_RT {
  if (!(x > 0.0)) return {0.0, 0.0, 0.0};
  if (x >= 1.0) return {1.0, 0.0, 0.0};
  const double y = 1.0 - x;
  return {x * x * x * (10.0 + x * (6.0 * x - 15.0)), 30.0 * x * x * y * y,
          60.0 * x * y * (1.0 - 2.0 * x)};
}

/// The largest ds/dx, at x = 1/2: a motion of length L in time T is at most 1.875 L / T fast.
inline constexpr double kMinJerkPeak = 1.875;

}  // namespace tandem
