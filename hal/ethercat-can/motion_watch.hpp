// Whether a joint moves within its limits, in any mode: the master's own look at its velocity,
// torque, power and swing, for drives that do not watch them.
// Layer: hal/ethercat-can.  Thread: the loop's.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "base/realtime.hpp"
#include "base/swing_watch.hpp"
#include "canopen/objects.hpp"
#include "hal/config/robot_config.hpp"

namespace tandem::hal::can {

/// What a joint may not be beyond for longer than `timeout_s`; 0: not watched.
struct MotionLimits {
  // Wider and later than the drive's own limits, so that a drive that watches gives up first.
  static constexpr double kMargin = 2.0;
  static constexpr double kLater_s = 0.1;
  static constexpr std::size_t kHalfSwings = 8;

  double velocity_rad_s = 0.0;
  double torque_Nm = 0.0;
  double power_W = 0.0;
  double swing_rad_s = 0.0;
  double timeout_s = 0.0;

  [[nodiscard]] static MotionLimits of(const JointConfig& joint) {
    MotionLimits limits{.swing_rad_s = joint.max_swing * joint.max_velocity_rad_s,
                        .timeout_s = joint.excess_time_s + kLater_s};
    if (joint.max_excess <= 0.0) return limits;
    const double most = 1.0 + kMargin * joint.max_excess;
    limits.velocity_rad_s = most * joint.max_velocity_rad_s;
    limits.torque_Nm = most * joint.max_torque_Nm;
    limits.power_W = most * joint.max_velocity_rad_s * joint.max_torque_Nm;
    return limits;
  }
};

/// A sample of a joint that is enabled.
struct MotionSample {
  double velocity_rad_s = 0.0;
  double torque_Nm = 0.0;        ///< measured; 0 where the drive does not tell
  double deviation_rad_s = 0.0;  ///< velocity less the reference's; see SwingWatch
  bool follows = false;          ///< a position or velocity: that deviation is one
};

class MotionWatch {
 public:
  explicit MotionWatch(const MotionLimits& limits) noexcept : limits_(limits) {}

  /// Once for every fresh sample, `dt_s` after the one before. @return kNone, or what it is beyond
  canopen::ErrorCode look(const MotionSample& sample, double dt_s) noexcept TANDEM_RT {
    using canopen::ErrorCode;
    const auto lasts = [&](double& since_s, double value, double limit) {
      const bool beyond = limit > 0.0 && std::abs(value) > limit;
      since_s = std::max(0.0, since_s + (beyond ? dt_s : -dt_s));
      return since_s > limits_.timeout_s;
    };
    const double power_W = sample.torque_Nm * sample.velocity_rad_s;
    const bool fast = lasts(too_fast_s_, sample.velocity_rad_s, limits_.velocity_rad_s);
    const bool strong = lasts(too_strong_s_, sample.torque_Nm, limits_.torque_Nm);
    const bool powerful = lasts(too_powerful_s_, power_W, limits_.power_W);
    bool swings = false;
    if (sample.follows) {
      swings = swing_.update(sample.deviation_rad_s, sample.torque_Nm, limits_.swing_rad_s,
                             MotionLimits::kHalfSwings, dt_s);
    } else {
      swing_.restart();
    }
    if (fast) return ErrorCode::kVelocityControl;
    if (strong) return ErrorCode::kExcessTorque;
    if (powerful) return ErrorCode::kExcessPower;
    return swings ? ErrorCode::kOscillation : ErrorCode::kNone;
  }
  /// The joint is not enabled, or not heard.
  void rest() noexcept TANDEM_RT {
    too_fast_s_ = too_strong_s_ = too_powerful_s_ = 0.0;
    swing_.restart();
  }

  template <class Archive>
  void archive(Archive& ar) {
    ar(too_fast_s_, too_strong_s_, too_powerful_s_, swing_);
  }

 private:
  MotionLimits limits_;
  double too_fast_s_ = 0.0;
  double too_strong_s_ = 0.0;
  double too_powerful_s_ = 0.0;
  SwingWatch swing_;
};

}  // namespace tandem::hal::can
