// Finds a robot with feet that fell, sank or flew away, in the cycle, from the plant's truth.
// Layer: runtime.  Thread: made non-RT; look() RT.
#pragma once

#include <cstdint>
#include <string>

#include "base/archive.hpp"
#include "base/realtime.hpp"
#include "hal/config/terrain.hpp"
#include "hal/stop_category.hpp"
#include "hal/truth.hpp"

namespace tandem::runtime {

/// When a robot with a floating base has fallen. Heights are of the base's origin above the ground.
struct FallLimits {
  bool watched = false;
  double ground_m = 0.0;                           ///< the level ground's height in W
  hal::Terrain terrain{};                          ///< over it
  double standing_m = 0.0;                         ///< where it stands in its first posture
  double highest_m = 0.0;                          ///< it starts there, or lower
  double tilt_rad = 1.0472;                        ///< of the base: 60 degrees
  double lowest_share = 0.3, highest_share = 3.0;  ///< of standing_m, of highest_m
  double sunk_share = 0.1;                         ///< a foot so deep, of standing_m
  std::int64_t airborne_ns = 1'000'000'000;        ///< no foot touches for so long
};

/// What was found, in whole thousandths: of a degree, a metre, a second.
struct Fall {
  hal::FaultCause cause = hal::FaultCause::kNone;
  std::int32_t thousandths = 0;
};

/// "the robot fell: its base is tilted by 61.3 degrees"
[[nodiscard]] std::string fall_text(const Fall& fall, const FallLimits& limits);

using hal::tilt_of;

class FallWatch {
 public:
  explicit FallWatch(const FallLimits& limits) : limits_(limits) {}

  /// A cycle in which controllers run. While the hoist holds the base nothing is found.
  [[nodiscard]] Fall look(const hal::TruthImage& truth) noexcept TANDEM_RT;
  /// Controllers start: flight is counted from here.
  void begin() noexcept TANDEM_RT { grounded_ns_ = -1; }
  [[nodiscard]] const FallLimits& limits() const noexcept { return limits_; }

  void archive(Archive& ar) { ar(grounded_ns_); }

 private:
  FallLimits limits_;
  std::int64_t grounded_ns_ = -1;  // when a foot touched last; -1: count from now
};

}  // namespace tandem::runtime
