#include "runtime/fall_watch.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <numbers>
#include <span>

namespace tandem::runtime {

using hal::FaultCause;

namespace {

Fall found(FaultCause cause, double value) noexcept {
  return {cause, static_cast<std::int32_t>(std::clamp(1e3 * value, -2e9, 2e9))};
}

/// The ground's height in W under a place, where it is by now.
double ground_under(const FallLimits& limits, const hal::GroundMotion& moved,
                    std::span<const double> place) noexcept TANDEM_RT {
  if (limits.terrain.level()) return limits.ground_m;
  const double x = place[0] - moved.position_m[0], y = place[1] - moved.position_m[1];
  return limits.ground_m + moved.position_m[2] + limits.terrain.at(x, y).height_m;
}

}  // namespace

Fall FallWatch::look(const hal::TruthImage& truth) noexcept TANDEM_RT {
  if (!limits_.watched || truth.hoist_share()[0] > 0.0) return {};
  const double tilt_rad = tilt_of(truth.base_quaternion());
  if (!(tilt_rad <= limits_.tilt_rad)) {
    return found(FaultCause::kTilted, tilt_rad * 180.0 / std::numbers::pi);
  }
  const hal::GroundMotion moved =
      limits_.terrain.motion_at(1e-9 * static_cast<double>(truth.time_ns()[0]));
  const auto base = truth.base_position_m();
  const double height_m = base[2] - ground_under(limits_, moved, base);
  if (!(height_m >= limits_.lowest_share * limits_.standing_m)) {
    return found(FaultCause::kLow, height_m);
  }
  if (height_m > limits_.highest_share * limits_.highest_m)
    return found(FaultCause::kHigh, height_m);
  bool touching = false;
  for (std::size_t f = 0; f < truth.feet(); ++f) {
    const auto foot = truth.foot_position_m().subspan(3 * f, 3);
    const double depth_m = ground_under(limits_, moved, foot) - foot[2];
    if (depth_m > limits_.sunk_share * limits_.standing_m) return found(FaultCause::kSunk, depth_m);
    touching = touching || truth.foot_force_N()[3 * f + 2] > 0.0;
  }
  const std::int64_t now_ns = truth.time_ns()[0];
  if (touching || grounded_ns_ < 0) grounded_ns_ = now_ns;
  const std::int64_t airborne_ns = now_ns - grounded_ns_;
  if (airborne_ns < limits_.airborne_ns) return {};
  return found(FaultCause::kAirborne, static_cast<double>(airborne_ns) * 1e-9);
}

std::string fall_text(const Fall& fall, const FallLimits& limits) {
  return fmt::format(
      fmt::runtime(hal::row_of(fall.cause).words), fmt::arg("value", 1e-3 * fall.thousandths),
      fmt::arg("standing_m", limits.standing_m), fmt::arg("highest_m", limits.highest_m));
}

}  // namespace tandem::runtime
