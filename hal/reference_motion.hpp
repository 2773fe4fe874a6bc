// A reference that moves no harder than its joint may: bounded velocity, acceleration and jerk.
// Layer: hal.  Thread: RT only.
#pragma once

#include <cstdint>
#include <limits>

#include "base/realtime.hpp"

namespace tandem::hal {

/// Infinity: not bounded. A jerk without an acceleration is not bounded.
struct MotionBounds {
  double min = -std::numeric_limits<double>::infinity();
  double max = std::numeric_limits<double>::infinity();
  double velocity = std::numeric_limits<double>::infinity();
  double acceleration = std::numeric_limits<double>::infinity();
  double jerk = std::numeric_limits<double>::infinity();
};

/// Where a motion comes to rest, from where it is, when it brakes as hard as it may.
/// @param velocity      now
/// @param acceleration  now; not used when jerk is not bounded
/// @pre   bounds.acceleration is finite
[[nodiscard]] double stopping_distance(double velocity, double acceleration,
                                       const MotionBounds& bounds) noexcept TANDEM_RT;

/// A reference in force, cycle by cycle: its differences are its velocity, acceleration and jerk.
///
/// A wanted reference within the bounds passes unchanged. One beyond them is followed as fast as
/// the bounds allow. The motion brakes in time to meet it, if its velocity stays as it is.
/// The bounds hold in each step, and the way to rest stays within min and max.
class ReferenceMotion {
 public:
  void begin(double position, double velocity = 0.0) noexcept TANDEM_RT {
    state_ = {position, velocity, 0.0, position, 1};
  }

  /// @param wanted  finite, within min and max
  /// @return the reference in force; `wanted` itself when the bounds allow it
  [[nodiscard]] double step(double wanted, const MotionBounds& bounds,
                            double period_s) noexcept TANDEM_RT;

  [[nodiscard]] double velocity() const noexcept TANDEM_RT { return state_.velocity; }

 private:
  struct State {  // plain bytes of a snapshot
    double position = 0.0;
    double velocity = 0.0;
    double acceleration = 0.0;
    double wanted = 0.0;         // in the last step
    std::int64_t following = 1;  // the last step was the wanted one
  };
  [[nodiscard]] bool may_follow(double wanted, const MotionBounds& bounds,
                                double period_s) const noexcept TANDEM_RT;
  [[nodiscard]] double chase(double wanted, const MotionBounds& bounds,
                             double period_s) const noexcept TANDEM_RT;

  State state_;
};

}  // namespace tandem::hal
