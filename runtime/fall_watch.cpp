#include "runtime/fall_watch.hpp"

#include <algorithm>
#include <cstdio>
#include <numbers>

namespace tandem::runtime {
namespace {

Fall found(FallKind kind, double value) noexcept {
  return {kind, static_cast<std::int32_t>(std::clamp(1e3 * value, -2e9, 2e9))};
}

}  // namespace

Fall FallWatch::look(const hal::TruthImage& truth) noexcept TANDEM_RT {
  if (!limits_.watched || truth.hoist_share()[0] > 0.0) return {};
  const double tilt_rad = tilt_of(truth.base_quaternion());
  if (!(tilt_rad <= limits_.tilt_rad)) {
    return found(FallKind::kTilted, tilt_rad * 180.0 / std::numbers::pi);
  }
  const double height_m = truth.base_position_m()[2] - limits_.ground_m;
  if (!(height_m >= limits_.lowest_share * limits_.standing_m)) {
    return found(FallKind::kLow, height_m);
  }
  if (height_m > limits_.highest_share * limits_.highest_m) return found(FallKind::kHigh, height_m);
  bool touching = false;
  for (std::size_t f = 0; f < truth.feet(); ++f) {
    const double depth_m = limits_.ground_m - truth.foot_position_m()[3 * f + 2];
    if (depth_m > limits_.sunk_share * limits_.standing_m) return found(FallKind::kSunk, depth_m);
    touching = touching || truth.foot_force_N()[3 * f + 2] > 0.0;
  }
  const std::int64_t now_ns = truth.time_ns()[0];
  if (touching || grounded_ns_ < 0) grounded_ns_ = now_ns;
  const std::int64_t airborne_ns = now_ns - grounded_ns_;
  if (airborne_ns < limits_.airborne_ns) return {};
  return found(FallKind::kAirborne, static_cast<double>(airborne_ns) * 1e-9);
}

std::string fall_text(const Fall& fall, const FallLimits& limits) {
  const double value = 1e-3 * fall.thousandths;
  char text[160] = "";
  switch (fall.kind) {
    case FallKind::kNone: break;
    case FallKind::kTilted:
      std::snprintf(text, sizeof text, "the robot fell: its base is tilted by %.1f degrees", value);
      break;
    case FallKind::kLow:
      std::snprintf(text, sizeof text,
                    "the robot fell: its base is %.3f m above the ground, and stands at %.3f m",
                    value, limits.standing_m);
      break;
    case FallKind::kHigh:
      std::snprintf(text, sizeof text,
                    "the robot flew away: its base is %.3f m above the ground, and started at "
                    "%.3f m",
                    value, limits.highest_m);
      break;
    case FallKind::kAirborne:
      std::snprintf(text, sizeof text, "the robot fell: no foot touches the ground since %.3f s",
                    value);
      break;
    case FallKind::kSunk:
      std::snprintf(text, sizeof text,
                    "the robot sank: a foot is %.3f m inside the ground (is [contact] too soft?)",
                    value);
      break;
  }
  return text;
}

}  // namespace tandem::runtime
