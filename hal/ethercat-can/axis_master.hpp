// The master's view of one axis: walks the drive machine up, latches faults, resets them.
// Layer: hal/ethercat-can.  Thread: the loop's.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>

#include "base/realtime.hpp"
#include "canopen/drive_abilities.hpp"
#include "canopen/drive_machine.hpp"
#include "hal/ethercat-can/axis_codec.hpp"
#include "hal/ethercat-can/follow_watch.hpp"
#include "hal/ethercat-can/homing_sequence.hpp"
#include "hal/ethercat-can/motion_watch.hpp"
#include "hal/ethercat-can/profile_limits.hpp"
#include "hal/image.hpp"

namespace tandem::hal::can {

/// Whether the drive has no fault of its own, and can brake.
[[nodiscard]] constexpr bool is_of_motion(FaultCause cause) noexcept {
  return cause == FaultCause::kNotFollowing ||
         (cause >= FaultCause::kTooFast && cause <= FaultCause::kSwings);
}

/// What a drive tells and can, where drives differ.
struct AxisTraits {
  canopen::DriveAbilities can{.machine = true,
                              .position = canopen::Mode::kCsp,
                              .velocity = canopen::Mode::kCsv,
                              .torque = canopen::Mode::kCst};
  bool tells_velocity = true;  ///< else it is the positions' difference
  bool tells_mode = true;      ///< else an enabled axis is in the mode that was sent
  bool homes = false;          ///< the joint has a homing, and the drive can be told to begin it
  bool tells_motor = true;     ///< the motor's position by itself; else the link's is taken for it
  bool asks_cause = false;     ///< its error code (603F) is in no PDO, and may be read by SDO
  FollowLimits follow{};
  MotionLimits motion{};
  ProfileLimits profile{};  ///< of a drive that moves in profile modes
};

class AxisMaster {
 public:
  /// What the axis is to do. Every target but kFollow makes its own command.
  enum class TargetState : std::uint8_t {
    kNothing,    ///< disable voltage: the bridge stays open
    kBringUp,    ///< the same as kEnable, and a fault from before this master's time is cleared
    kEnable,     ///< walk to Operation Enabled, hold the measured position
    kFollow,     ///< the command image
    kHold,       ///< keep the position that it has, or the command image as long as that brakes
    kQuickStop,  ///< stop category 1
    kReset,      ///< clear the drive's fault; then it waits, disabled
    kHome,       ///< the drive looks for the joint's place; then it is held, until it follows
  };

  static constexpr std::int64_t kEnableTimeoutNs = 2'000'000'000;
  static constexpr std::int64_t kResetTimeoutNs = 1'000'000'000;
  /// How long a drive may stay in Operation Enabled after category 0 and after a quick stop: a
  /// drive that ramps down is in Quick Stop Active.
  static constexpr std::int64_t kDisableTimeoutNs = 200'000'000;
  static constexpr std::int64_t kQuickStopTimeoutNs = 500'000'000;
  /// When a drive that stays in Operation Enabled in spite of a quick stop is sent "disable
  /// voltage", which it may obey.
  static constexpr std::int64_t kQuickStopPatienceNs = 300'000'000;
  /// When a drive that stays in Quick Stop Active is let go, if it is slower than this [rad/s,
  /// m/s].
  static constexpr std::int64_t kQuickStopRestNs = 1'000'000'000;
  static constexpr double kRestVelocity_rad_s = 0.01;
  static constexpr std::uint32_t kObeyCycles = 4;  ///< at least so many samples in any of them
  /// A fault reset's bit 7 changes every so many cycles, so that a board that looks seldom sees it.
  static constexpr std::uint32_t kResetToggleCycles = 4;

  /// @param stiffness, damping  of the impedance mode until a command says otherwise
  AxisMaster(const AxisScale& scale, const AxisTraits& traits, double stiffness_Nm_rad,
             double damping_Nms_rad) noexcept
      : scale_(scale), traits_(traits), lag_(traits.follow), motion_(traits.motion) {
    raw_.stiffness = static_cast<float>(stiffness_Nm_rad);
    raw_.damping = static_cast<float>(damping_Nms_rad);
  }

  /// Where a field of a slow TPDO goes, which counts at once.
  [[nodiscard]] void* slow_variable(WireField field) noexcept { return feedback_.variable(field); }
  /// Where a field of an every-SYNC TPDO goes: it counts when received() says that the sample is
  /// whole.
  [[nodiscard]] void* sample_variable(WireField field) noexcept { return sample_.variable(field); }
  /// Where a field of an RPDO comes from.
  [[nodiscard]] void* command_variable(WireField field) noexcept {
    const bool set_point =
        field == WireField::kTargetPosition && traits_.can.position == canopen::Mode::kPp;
    return set_point ? &set_point_ : raw_.variable(field);
  }
  /// The axis' error code from an emergency of its board; `told`: warnings may tell it.
  void on_emergency(std::uint16_t code, bool told) noexcept TANDEM_RT {
    emergency_code_ = code;
    if (told && code != 0) last_emergency_ = code;
    take_cause(code);
  }
  /// The drive is in a fault whose cause no PDO tells, and it has not been asked yet.
  [[nodiscard]] bool wants_cause() const noexcept TANDEM_RT {
    return traits_.asks_cause && !asked_ && unknown_cause();
  }
  void cause_asked() noexcept TANDEM_RT { asked_ = true; }
  /// What it answered, or an emergency said, of a fault that has no cause yet; 0: nothing.
  void take_cause(std::uint16_t code) noexcept TANDEM_RT {
    if (code != 0 && unknown_cause()) fault_code_ = code;
  }
  /// The code of the last emergency that may be told, if the axis has had no fault with it; 0:
  /// none.
  [[nodiscard]] std::uint16_t emergency_without_fault() const noexcept {
    return last_emergency_ == fault_code_ ? std::uint16_t{0} : last_emergency_;
  }
  /// Once per cycle, after its frames. `fresh`: every part of a sample came in this cycle.
  void received(bool fresh, std::int64_t now_ns) noexcept TANDEM_RT;
  /// Looks for a fault in what was received. @return true when it is a new one.
  bool check(std::int64_t now_ns) noexcept TANDEM_RT;
  /// Whether the drive stays enabled in spite of a stop: once a cycle, after received().
  [[nodiscard]] bool ignores_stop(std::int64_t now_ns) noexcept TANDEM_RT;
  /// @param error  of a board: one of its causes; the node says which
  void latch(FaultCause error, std::uint16_t code, std::int64_t now_ns) noexcept TANDEM_RT;

  void set_target(TargetState target, std::int64_t now_ns) noexcept TANDEM_RT;
  /// Homes an axis that follows. Afterwards, however it ends, the axis is held where it stands,
  /// and follows the image again once that has had the joint idle, and then not any more: what the
  /// image had before is of other counts.
  /// @return false: the axis has no homing, is not enabled or does not follow; nothing has changed
  bool home(std::int64_t timeout_ns, std::int64_t now_ns) noexcept TANDEM_RT;
  void stop_homing(std::int64_t now_ns) noexcept TANDEM_RT { homing_.stop(now_ns); }
  [[nodiscard]] Homing homing() const noexcept TANDEM_RT;
  /// Makes the raw command of the target; kFollow takes it from the image.
  /// @return true when a reset or a re-enabling has just failed and was latched.
  bool command(const CommandImage* image, std::size_t joint,
               std::int64_t now_ns) noexcept TANDEM_RT;

  /// The joint's fields of the image.
  void fill(StateImage& state, std::size_t joint) const noexcept TANDEM_RT;

  [[nodiscard]] const RawCommand& raw() const noexcept { return raw_; }
  [[nodiscard]] const RawFeedback& feedback() const noexcept { return feedback_; }
  [[nodiscard]] TargetState target() const noexcept { return target_; }
  [[nodiscard]] bool heard() const noexcept { return heard_; }
  [[nodiscard]] std::uint32_t age_cycles() const noexcept { return age_cycles_; }
  [[nodiscard]] canopen::DriveMachineState drive() const noexcept {
    return canopen::drive_state(feedback_.statusword);
  }
  [[nodiscard]] bool enabled() const noexcept {
    return heard_ && drive() == canopen::DriveMachineState::kOperationEnabled;
  }
  /// kReset is not through: the drive is in fault, or has not been disabled yet.
  [[nodiscard]] bool in_reset() const noexcept TANDEM_RT;
  /// True when no torque can come from the drive any more.
  [[nodiscard]] bool off() const noexcept TANDEM_RT;
  [[nodiscard]] FaultCause error() const noexcept { return error_; }
  [[nodiscard]] std::uint16_t fault_code() const noexcept { return fault_code_; }
  [[nodiscard]] std::int64_t trouble_time_ns() const noexcept { return trouble_ns_; }
  void clear_error() noexcept { error_ = FaultCause::kNone; }
  /// The node is configured anew: nothing of what was heard holds any more.
  void forget() noexcept TANDEM_RT;

  void archive(Archive& ar);

 private:
  void follow(const CommandImage& image, std::size_t joint, std::int64_t now_ns) noexcept;
  [[nodiscard]] bool ignores_quick_stop(std::int64_t now_ns) const noexcept TANDEM_RT;
  [[nodiscard]] bool rests_in_quick_stop(std::int64_t now_ns) const noexcept TANDEM_RT;
  void walk_up(bool clears_faults, std::int64_t now_ns) noexcept;
  [[nodiscard]] bool unknown_cause() const noexcept TANDEM_RT {
    return error_ == FaultCause::kDrive &&
           fault_code_ == static_cast<std::uint16_t>(canopen::ErrorCode::kGeneric);
  }
  [[nodiscard]] std::uint16_t enable_operation() noexcept;
  [[nodiscard]] std::uint16_t hand_set_point_over() noexcept;
  void encode(const CommandImage& image, std::size_t joint) noexcept;
  [[nodiscard]] std::int32_t resting_place(std::int32_t position,
                                           std::int32_t velocity) const noexcept;
  [[nodiscard]] std::uint16_t reset_controlword() noexcept;
  void seed() noexcept;
  void brake(const CommandImage* image, std::size_t joint) noexcept TANDEM_RT;
  [[nodiscard]] std::int64_t step_from(std::int32_t target) const noexcept TANDEM_RT;
  [[nodiscard]] bool lags(std::int64_t now_ns) noexcept;
  /// What the joint's motion is beyond, or kNone.
  [[nodiscard]] canopen::ErrorCode excess(std::int64_t now_ns) noexcept;
  [[nodiscard]] MotionSample motion_sample(double dt_s) noexcept;
  [[nodiscard]] double counts_to(std::int32_t target) const noexcept;
  [[nodiscard]] double position_error_rad() const noexcept;
  bool enable_is_late(std::int64_t now_ns) noexcept;
  bool reset_is_late(std::int64_t now_ns) noexcept;
  void go_home(const CommandImage* image, std::size_t joint, std::int64_t now_ns) noexcept;

  static constexpr std::int64_t kNoSetPoint = std::numeric_limits<std::int64_t>::max();

  AxisScale scale_;
  AxisTraits traits_;
  RawFeedback feedback_;
  RawFeedback sample_;  ///< what has come of this cycle's sample; no state
  RawCommand raw_;
  TargetState target_ = TargetState::kNothing;
  FaultCause error_ = FaultCause::kNone;
  HomingSequence homing_;
  FollowWatch lag_;
  MotionWatch motion_;
  double watched_error_rad_ = 0.0;  ///< of the position, at the last look at the motion
  std::int64_t watched_ns_ = 0;
  std::int64_t watched_mode_ = 0;
  std::int32_t aim_ = 0;        ///< profile position: where the joint is to come to rest
  std::int32_t set_point_ = 0;  ///< profile position: on the wire
  std::int64_t last_set_point_ = kNoSetPoint;  ///< that was offered to the drive
  bool offers_ = false;                        ///< bit 4 is set for it
  std::int32_t previous_target_ = 0;           ///< the target position before the one in `raw_`
  std::int64_t longest_step_ = 0;  ///< kHold: that the target may go in a cycle [counts]
  bool was_idle_ = false;          ///< kHome: the image has had the joint idle since
  bool heard_ = false;
  bool asked_ = false;        ///< for the cause of the fault that is latched
  bool was_enabled_ = false;  ///< reached Operation Enabled under the present wish to be
  std::uint16_t fault_code_ = 0;
  std::uint16_t emergency_code_ = 0;
  std::uint16_t last_emergency_ = 0;  ///< for a warning
  std::uint32_t age_cycles_ = 0;
  std::uint32_t reset_cycles_ = 0;
  std::uint32_t disobedient_cycles_ = 0;  ///< since the stop: samples of an enabled drive
  std::uint32_t held_cycles_ = 0;         ///< kHome: since the homing is over
  std::int32_t previous_velocity_ = 0;
  std::int64_t sample_ns_ = 0;
  std::int64_t trouble_ns_ = 0;
  std::int64_t since_ns_ = 0;  ///< when the target, or the wish to be enabled, began
  double acceleration_rad_s2_ = 0.0;
};

}  // namespace tandem::hal::can
