// One step of a reference with bounded jerk. It follows exactly where the bounds allow it; else
// bisection finds the acceleration from which it can still stop at the reference and inside the
// range.
#include "hal/reference_motion.hpp"

#include <algorithm>
#include <cmath>

namespace tandem::hal {
namespace {

constexpr double kEps = std::numeric_limits<double>::epsilon();
constexpr int kBisections = 40;  // of a range of accelerations: to 1e-12 of it

/// What a motion at a constant acceleration has gained after some time.
struct Gained {
  double distance, velocity;
};
/// @param jerk  of the acceleration, which begins as `acceleration`
Gained after(double time, double velocity, double acceleration, double jerk) noexcept TANDEM_RT {
  return {time * (velocity + time * (acceleration / 2.0 + time * jerk / 6.0)),
          time * (acceleration + time * jerk / 2.0)};
}

/// The velocity that is left when the acceleration is brought to nothing at once.
double settled_velocity(double velocity, double acceleration, double jerk) noexcept TANDEM_RT {
  return velocity + acceleration * std::abs(acceleration) / (2.0 * jerk);
}

/// The largest of [low, high] that is allowed, where all below an allowed one are; low if none is.
template <class Allowed>
double largest(double low, double high, const Allowed& allowed) noexcept TANDEM_RT {
  if (allowed(high)) return high;
  for (int i = 0; i < kBisections; ++i) {
    const double middle = 0.5 * (low + high);
    (allowed(middle) ? low : high) = middle;
  }
  return low;
}

}  // namespace

double stopping_distance(double velocity, double acceleration,
                         const MotionBounds& bounds) noexcept TANDEM_RT {
  const double jerk = bounds.jerk, hardest = bounds.acceleration;
  if (!std::isfinite(jerk)) return velocity * std::abs(velocity) / (2.0 * hardest);
  if (settled_velocity(velocity, acceleration, jerk) < 0.0) {
    return -stopping_distance(-velocity, -acceleration, bounds);
  }
  // Down to the peak, along it where it is the hardest, and back to nothing.
  const double peak = std::min(
      hardest, std::sqrt(std::max(0.0, jerk * velocity + acceleration * acceleration / 2)));
  const Gained down = after((acceleration + peak) / jerk, velocity, acceleration, -jerk);
  const double at_peak = velocity + down.velocity;
  const double back_s = peak / jerk;
  const double along_s = peak > 0.0 ? std::max(0.0, at_peak / peak - back_s / 2.0) : 0.0;
  const Gained along = after(along_s, at_peak, -peak, 0.0);
  return down.distance + along.distance +
         after(back_s, at_peak + along.velocity, -peak, jerk).distance;
}

bool ReferenceMotion::may_follow(double wanted, const MotionBounds& bounds,
                                 double period_s) const noexcept TANDEM_RT {
  const State& s = state_;
  // Differences of what was rounded are not exact: 16 units in the last place of the reference.
  const double rounding = 16.0 * kEps * std::max(std::abs(wanted), std::abs(s.position));
  const auto within = [](double value, double bound, double slack) {
    return std::abs(value) <= bound * (1.0 + 1e-9) + slack;
  };
  const double velocity = (wanted - s.position) / period_s;
  const double acceleration = (velocity - s.velocity) / period_s;
  const double jerk_slack = rounding / (period_s * period_s * period_s);
  if (!within(velocity, bounds.velocity, rounding / period_s)) return false;
  if (!within(acceleration, bounds.acceleration, rounding / (period_s * period_s))) return false;
  if (!within(acceleration - s.acceleration, bounds.jerk * period_s, jerk_slack * period_s)) {
    return false;
  }
  const double rest = wanted + stopping_distance(velocity, acceleration, bounds);
  if (rest > bounds.max + rounding && velocity > 0.0) return false;
  if (rest < bounds.min - rounding && velocity < 0.0) return false;
  if (s.following != 0) return true;
  // Met: it must be able to go on with the reference from here.
  const double goes_on = ((wanted - s.wanted) / period_s - velocity) / period_s;
  return within(goes_on, bounds.acceleration, 0.0) &&
         within(goes_on, bounds.jerk * period_s, jerk_slack * period_s) &&
         within(goes_on - acceleration, bounds.jerk * period_s, jerk_slack * period_s);
}

/// The acceleration of this step.
double ReferenceMotion::chase(double wanted, const MotionBounds& bounds,
                              double period_s) const noexcept TANDEM_RT {
  const State& s = state_;
  const double change = bounds.jerk * period_s;
  const double low = std::max(-bounds.acceleration, s.acceleration - change);
  const double high = std::min(bounds.acceleration, s.acceleration + change);
  const double jump = (wanted - s.wanted) / period_s;
  const double pace = std::abs(jump) > bounds.velocity ? 0.0 : jump;
  const auto velocity_after = [&](double a) { return s.velocity + a * period_s; };
  const auto position_after = [&](double a) { return s.position + velocity_after(a) * period_s; };
  // Side 1: of a motion upward; -1 turns everything about.
  const auto overshoots = [&](double side, double a) {
    const double velocity = velocity_after(a);
    const double settled =
        std::isfinite(bounds.jerk) ? settled_velocity(velocity, a, bounds.jerk) : velocity;
    if (side * settled > bounds.velocity) return true;
    const double rest = position_after(a) + stopping_distance(velocity - pace, a, bounds);
    return side * (rest - wanted) > 0.0;
  };
  const auto leaves = [&](double side, double edge, double a) {  // one that is outside may come in
    const double rest = position_after(a) + stopping_distance(velocity_after(a), a, bounds);
    return side * (rest - edge) > 0.0 && side * (s.position - edge) <= 0.0;
  };
  double a = wanted >= s.position
                 ? largest(low, high, [&](double up) { return !overshoots(1.0, up); })
                 : -largest(-high, -low, [&](double down) { return !overshoots(-1.0, -down); });
  a = largest(low, a, [&](double up) { return !leaves(1.0, bounds.max, up); });
  return -largest(-high, -a, [&](double down) { return !leaves(-1.0, bounds.min, -down); });
}

double ReferenceMotion::step(double wanted, const MotionBounds& bounds,
                             double period_s) noexcept TANDEM_RT {
  State& s = state_;
  const State last = s;
  s.following = may_follow(wanted, bounds, period_s) ? 1 : 0;
  if (s.following != 0) {
    s.velocity = (wanted - last.position) / period_s;
    s.acceleration = (s.velocity - last.velocity) / period_s;
    s.position = wanted;
  } else {
    s.acceleration = chase(wanted, bounds, period_s);
    s.velocity = last.velocity + s.acceleration * period_s;
    s.position = last.position + s.velocity * period_s;
  }
  s.wanted = wanted;
  return s.position;
}

}  // namespace tandem::hal
