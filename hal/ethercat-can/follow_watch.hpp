// Whether a joint in position control stays near its command: the master's own look at it, for
// drives that do not notice, or that do not hear their commands.
// Layer: hal/ethercat-can.  Thread: the loop's.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "base/archive.hpp"
#include "base/realtime.hpp"
#include "hal/config/robot_config.hpp"

namespace tandem::hal::can {

/// A position may be further than `window_rad` from the command for `timeout_ns`; 0 rad: for ever.
struct FollowLimits {
  /// Wider and later than the drive's own limits, so that a drive that watches gives up first.
  static constexpr double kMargin = 1.5;
  static constexpr double kLater_s = 0.1;
  /// Without a following_error_rad in the file: so far behind at the joint's maximum velocity.
  static constexpr double kLag_s = 0.1;

  double window_rad = 0.0;
  std::int64_t timeout_ns = 0;

  /// @param limited  the drive gets the joint's limits: our own boards do, given or not
  [[nodiscard]] static FollowLimits of(const JointConfig& joint, bool limited) {
    double error_rad = joint.following_error_rad;
    const double lag_rad = kLag_s * joint.max_velocity_rad_s;
    if (!limited && joint.following_error_rad.line == 0 && lag_rad > 0.0) {
      error_rad = std::min(error_rad, lag_rad);
    }
    return {.window_rad = kMargin * error_rad,
            .timeout_ns = std::llround(1e9 * (joint.following_timeout_s + kLater_s))};
  }
};

class FollowWatch {
 public:
  explicit FollowWatch(const FollowLimits& limits) noexcept : limits_(limits) {}

  [[nodiscard]] double window_rad() const noexcept { return limits_.window_rad; }
  /// Once for every fresh sample. @return whether the error has been too large for too long
  bool look(double error_rad, std::int64_t now_ns) noexcept TANDEM_RT {
    if (limits_.window_rad <= 0.0 || error_rad <= limits_.window_rad) {
      since_ns_ = kNever;
      return false;
    }
    if (since_ns_ == kNever) since_ns_ = now_ns;
    return now_ns - since_ns_ > limits_.timeout_ns;
  }
  /// Nothing is to be followed.
  void rest() noexcept TANDEM_RT { since_ns_ = kNever; }

  void archive(Archive& ar) { ar(since_ns_); }

 private:
  static constexpr std::int64_t kNever = -1;

  FollowLimits limits_;
  std::int64_t since_ns_ = kNever;  ///< the error is too large
};

}  // namespace tandem::hal::can
