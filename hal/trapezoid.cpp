// The velocity of the next step is the largest from which constant braking still ends at the
// target.
#include "hal/trapezoid.hpp"

#include <algorithm>
#include <cmath>

namespace tandem::hal {

bool Trapezoid::step(double target_rad, double speed_rad_s, double acceleration_rad_s2,
                     double dt_s) noexcept TANDEM_RT {
  const double a = acceleration_rad_s2;
  const double change = a * dt_s;  // of the velocity, at most
  const double way = target_rad - position_rad;
  if (std::abs(way) <= std::min(change, speed_rad_s) * dt_s && std::abs(velocity_rad_s) <= change) {
    position_rad = target_rad;
    velocity_rad_s = 0.0;
    return true;
  }
  // The largest next velocity w from which braking still ends at the target: w^2 / (2 a) is the
  // way that is left after this step, way - (v + w) dt / 2.
  const double side = way < 0.0 ? -1.0 : 1.0;
  const double left = side * (way - velocity_rad_s * dt_s / 2.0);
  const double twice = 2.0 * std::max(left, 0.0);
  const double brake = twice / (std::sqrt(dt_s * dt_s / 4.0 + twice / a) + dt_s / 2.0);
  const double wanted = side * std::min(brake, speed_rad_s);
  run(wanted, a, dt_s);
  return false;
}

void Trapezoid::run(double target_rad_s, double acceleration_rad_s2,
                    double dt_s) noexcept TANDEM_RT {
  const double change = acceleration_rad_s2 * dt_s;
  const double next = std::clamp(target_rad_s, velocity_rad_s - change, velocity_rad_s + change);
  position_rad += (velocity_rad_s + next) * dt_s / 2.0;
  velocity_rad_s = next;
}

}  // namespace tandem::hal
