// References for every cycle of a replay: a recording on the run's cycles, with a run-up before it
// and a run-down after it.
// Layer: controllers.  Thread: make() non-RT; the rest any.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "base/realtime.hpp"
#include "base/result.hpp"
#include "controllers/segment.hpp"
#include "hal/robot.hpp"
#include "log/joint_motion.hpp"

namespace tandem {

/// The whole motion of a replay, which its robot can do.
///
/// Begins and ends at rest: where a joint moves at the recording's begin or end, its speed grows
/// and falls along a smooth step within log::kReplayRunUp_s (whole cycles), on a straight line;
/// below a hundredth of its limit it rests. Between samples the position is a cubic through them
/// with the slopes of their neighbours (Catmull and Rom), and the velocity is the line between the
/// recorded ones or, without them, that cubic's.
class MotionPlan {
 public:
  /// @param joints  of `robot`, one for each of the motion's tracks
  /// @param speed   times as fast as recorded, above 0: times are divided, velocities multiplied by
  ///                it; torques stay, and run-up and run-down take as long
  /// Errors: a joint that leaves its limits of position, speed or (where it is played) torque, with
  /// the recording's time; more cycles than memory is meant for.
  [[nodiscard]] static Result<MotionPlan> make(const log::JointMotion& motion,
                                               const hal::Robot& robot,
                                               const std::vector<std::size_t>& joints,
                                               std::int64_t period_ns, double speed = 1.0);

  [[nodiscard]] std::size_t cycles() const noexcept TANDEM_RT { return cycles_; }
  [[nodiscard]] double duration_s() const noexcept {
    return static_cast<double>(cycles_) * period_s_;
  }
  [[nodiscard]] bool has_torque() const noexcept TANDEM_RT { return !torque_Nm_.empty(); }
  /// @param joint  of those given to make()
  /// @param cycle  0 to cycles() - 1; the velocity of the last one is 0
  [[nodiscard]] double position(std::size_t joint, std::size_t cycle) const noexcept TANDEM_RT {
    return position_rad_[cycle * joints_ + joint];
  }
  [[nodiscard]] double velocity(std::size_t joint, std::size_t cycle) const noexcept TANDEM_RT {
    return velocity_rad_s_[cycle * joints_ + joint];
  }
  [[nodiscard]] double torque(std::size_t joint, std::size_t cycle) const noexcept TANDEM_RT {
    return torque_Nm_[cycle * joints_ + joint];
  }

 private:
  void sample(const log::JointTrack& track, std::size_t joint, std::int64_t begin_ns);
  void ramp(std::size_t joint, double rest_rad_s);
  /// Where a cycle is in the recording, or how long before or after it.
  [[nodiscard]] std::string when(const log::JointMotion& motion, std::size_t cycle) const;
  [[nodiscard]] Status check(const log::JointMotion& motion, const hal::DrivenJoint& limits,
                             std::size_t joint) const;

  std::size_t joints_ = 0, cycles_ = 0, run_up_ = 0, recorded_ = 0;
  std::int64_t period_ns_ = 0;
  double period_s_ = 0.0, speed_ = 1.0;
  std::vector<double> position_rad_, velocity_rad_s_, torque_Nm_;  // [cycle][joint]
};

/// How long a minimum-jerk motion takes that uses at most half of a joint's speed, and no more than
/// what it declares of acceleration and jerk.
[[nodiscard]] double approach_time_s(double way_rad,
                                     const hal::DrivenJoint& joint) noexcept TANDEM_RT;

}  // namespace tandem
