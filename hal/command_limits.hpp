// The last gate before the wire: every command is finite, in range and no faster than allowed.
// Layer: hal.  Thread: RT (made non-RT).
#pragma once

#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "base/realtime.hpp"
#include "hal/image.hpp"
#include "hal/joint_capabilities.hpp"
#include "hal/limit_met.hpp"
#include "hal/reference_motion.hpp"
#include "hal/robot.hpp"

namespace tandem {
class Archive;
}

namespace tandem::hal {

/// How often a joint's command had to be changed since the start.
struct LimitCounters {
  std::uint32_t not_finite = 0;    ///< a NaN, an infinity or a mode that does not exist
  std::uint32_t out_of_range = 0;  ///< a reference beyond its limit
  std::uint32_t too_fast = 0;      ///< a reference that moved faster than it may
};

/// Corrects commands in place, joint by joint: finite check, range limit, rate limit.
///
/// - A value that is not finite is replaced by the last good one of its field.
/// - Position, velocity, torque, voltage, current, stiffness and damping are held within the
///   joint's limits (JointCapabilities). In velocity mode a reference that leads further beyond
///   a position limit is zero.
/// - A joint that stands outside its range when its position loop is closed stays there: its
///   reference may come in, at kRecoveryShare of its velocity, and not go out again.
/// - A position reference moves by at most max velocity * period from the last one. Where the
///   position loop is not yet closed (other mode, compliant, drive not enabled) the last one is
///   the measured position, so that every start is from where the joint stands. In other modes the
///   position reference is not used, and set to the measured position.
/// - A position reference keeps the joint's acceleration and jerk, a velocity reference its
///   acceleration and jerk: ReferenceMotion. Where the position loop closes on a joint that moves,
///   the reference departs at its velocity.
/// - While an acceleration holds a position reference back, the velocity reference beside it is its
///   velocity.
/// - Torque, and in its mode velocity, current, voltage, stiffness and damping, change by no more
///   than their limit in kFullScale_s (current and voltage: JointCapabilities has their rates). A
///   loop that was open starts from what is measured, or free. A value that nobody has written
///   since goes on toward what was wanted.
class CommandLimits {
 public:
  /// Speed of a joint that is led back into its range, as a share of its maximum velocity.
  static constexpr double kRecoveryShare = 0.05;

  CommandLimits(const Robot& robot, std::int64_t period_ns);

  /// Corrects `command`. `state` is this cycle's.
  /// @return kNotFinite or kOutOfRange when a joint needed it (the former goes first); a
  ///         reference that is only too fast is corrected and counted, and kOk.
  /// @pre   both images have this robot's joints.
  /// @rt    no allocation, lock or throw; O(joints).
  [[nodiscard]] Code apply(const StateImage& state, CommandImage& command) noexcept TANDEM_RT;

  /// `command` is what the joints follow now, by whoever: the next one is limited from there.
  void follow(const CommandImage& command) noexcept TANDEM_RT;

  /// What apply() answered for each joint in the last cycle.
  [[nodiscard]] std::span<const Code> codes() const noexcept { return codes_; }
  [[nodiscard]] std::span<const LimitCounters> counters() const noexcept { return counters_; }
  /// What was changed of each joint in the last cycle: the worst, and of those the first.
  [[nodiscard]] std::span<const LimitMet> met() const noexcept { return met_; }
  [[nodiscard]] std::span<const JointCapabilities> limits() const noexcept { return limits_; }

  void archive(Archive& ar);

 private:
  /// The references that went to the wire last.
  struct Last {
    double position_rad = 0.0;
    double velocity_rad_s = 0.0;
    double torque_Nm = 0.0;
    double voltage_V = 0.0;
    double current_A = 0.0;
    double stiffness_Nm_rad = 0.0;
    double damping_Nms_rad = 0.0;
    // What was wanted of those that may not change at once.
    double velocity_wish_rad_s = 0.0;
    double torque_wish_Nm = 0.0;
    double voltage_wish_V = 0.0;
    double current_wish_A = 0.0;
    double stiffness_wish_Nm_rad = 0.0;
    double damping_wish_Nms_rad = 0.0;
    std::int64_t mode = 0;
    std::int64_t interaction = 0;
    std::int64_t operates = 0;   // the drive followed it
    double speed_rad_s = 0.0;    // of the position reference
    std::int64_t held_back = 0;  // the position reference was
  };
  /// A value that a limit is about to change.
  struct Met {
    CommandField field;
    LimitKind kind;
    double value, limit = 0.0;
    std::uint8_t derivative = 0;  // that the limit is of
  };
  void note(std::size_t joint, const Met& met) noexcept TANDEM_RT;
  void note_speed(std::size_t joint, double reference, double asked_rad_s, double before_rad_s,
                  double most_rad_s) noexcept TANDEM_RT;
  void modes(std::size_t joint, CommandImage& command) noexcept TANDEM_RT;
  void position(std::size_t joint, const StateImage& state,
                CommandImage& command) noexcept TANDEM_RT;
  void velocity(std::size_t joint, const Last& was, const StateImage& state,
                CommandImage& command) noexcept TANDEM_RT;
  void brake_before_ends(std::size_t joint, double position_rad,
                         double& reference) noexcept TANDEM_RT;
  void torque(std::size_t joint, const Last& was, const StateImage& state,
              CommandImage& command) noexcept TANDEM_RT;
  /// Voltage and current: of the last gate before the motor.
  void direct(std::size_t joint, const Last& was, const StateImage& state,
              CommandImage& command) noexcept TANDEM_RT;
  void impedance(std::size_t joint, const Last& was, const StateImage& state,
                 CommandImage& command) noexcept TANDEM_RT;
  /// Holds `value` near `from`, and counts it.
  void rated(std::size_t joint, CommandField field, double& value, double& last, double from,
             double step) noexcept TANDEM_RT;
  void bounded(std::size_t joint, CommandField field, double& value, double& last, double min,
               double max) noexcept TANDEM_RT {
    if (!(std::isfinite(value) && value >= min && value <= max)) [[unlikely]]
      correct(joint, field, value, last, min, max);
    last = value;
  }
  void correct(std::size_t joint, CommandField field, double& value, double last, double min,
               double max) noexcept TANDEM_RT;

  double period_s_;
  std::vector<JointCapabilities> limits_;
  std::vector<Last> last_;
  std::vector<ReferenceMotion> position_, velocity_;  // of joints with a declared acceleration
  std::vector<LimitCounters> counters_;
  std::vector<Code> codes_;
  std::vector<LimitMet> met_;
};

}  // namespace tandem::hal
