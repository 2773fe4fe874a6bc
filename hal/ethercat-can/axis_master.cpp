// Turns an axis' target (nothing, enable, follow, hold, quick stop, reset) into the controlword of
// each cycle, and latches the first deviation of the drive from it.
#include "hal/ethercat-can/axis_master.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/archive.hpp"

namespace tandem::hal::can {

using canopen::ErrorCode;
using WireState = canopen::DriveMachineState;
namespace controlword = canopen::controlword;

namespace {

bool is_stiff_position(const CommandImage& image, std::size_t joint) noexcept TANDEM_RT {
  return image.mode()[joint] == static_cast<std::int8_t>(ControlMode::kPosition) &&
         image.interaction()[joint] == static_cast<std::uint8_t>(InteractionMode::kStiff);
}

FaultCause cause_beyond(ErrorCode code) noexcept TANDEM_RT {
  switch (code) {
    case ErrorCode::kVelocityControl: return FaultCause::kTooFast;
    case ErrorCode::kExcessTorque: return FaultCause::kTooStrong;
    case ErrorCode::kExcessPower: return FaultCause::kTooPowerful;
    default: return FaultCause::kSwings;
  }
}

}  // namespace

void AxisMaster::received(bool fresh, std::int64_t now_ns) noexcept TANDEM_RT {
  if (!fresh) {
    ++age_cycles_;
    return;
  }
  const std::int32_t last_position = feedback_.position;
  feedback_.adopt(sample_);
  if (!heard_) scale_.find_turn(feedback_.position);
  const std::int64_t elapsed_ns = now_ns - sample_ns_;
  const bool recounts = homing_.under_way();  // a jump of the counts is no motion
  if (!traits_.tells_velocity && heard_ && elapsed_ns > 0 && !recounts) {
    const auto counts = static_cast<std::int32_t>(  // the counter may wrap around
        static_cast<std::uint32_t>(feedback_.position) - static_cast<std::uint32_t>(last_position));
    feedback_.velocity = canopen::clamp_round<std::int32_t>(
        counts * (scale_.velocity_per_rad_s / scale_.counts_per_rad) * 1.0e9 /
        static_cast<double>(elapsed_ns));
  }
  if (heard_ && elapsed_ns > 0) {
    const double change = static_cast<double>(feedback_.velocity) - previous_velocity_;
    acceleration_rad_s2_ =
        change / scale_.velocity_per_rad_s * 1.0e9 / static_cast<double>(elapsed_ns);
  }
  previous_velocity_ = feedback_.velocity;
  sample_ns_ = now_ns;
  heard_ = true;
  age_cycles_ = 0;
}

bool AxisMaster::check(std::int64_t now_ns) noexcept TANDEM_RT {
  if (!heard_) return false;
  const WireState state = drive();
  const bool faulted = state == WireState::kFault || state == WireState::kFaultReactionActive;
  if (error_ != FaultCause::kNone) {
    // The error code may come later than the statusword, for it travels in the slow PDO. It may be
    // another one than at first: what is there now is what a reset has to do with.
    if (!is_of_board(error_) && faulted && feedback_.error_code != 0) {
      error_ = FaultCause::kDrive;
      fault_code_ = feedback_.error_code;
    }
    return false;
  }
  if (faulted && target_ != TargetState::kReset && target_ != TargetState::kBringUp) {
    const std::uint16_t code = feedback_.error_code != 0 ? feedback_.error_code : emergency_code_;
    latch(FaultCause::kDrive, code != 0 ? code : static_cast<std::uint16_t>(ErrorCode::kGeneric),
          now_ns);
    return true;
  }
  const bool stays_enabled = target_ == TargetState::kFollow || target_ == TargetState::kHold ||
                             target_ == TargetState::kHome;
  if (was_enabled_ && state != WireState::kOperationEnabled && stays_enabled) {
    latch(FaultCause::kLeftEnabled, static_cast<std::uint16_t>(ErrorCode::kGeneric), now_ns);
    return true;
  }
  if (lags(now_ns)) {
    latch(FaultCause::kNotFollowing, static_cast<std::uint16_t>(ErrorCode::kFollowingError),
          now_ns);
    return true;
  }
  const ErrorCode beyond = excess(now_ns);
  if (beyond == ErrorCode::kNone) return false;
  latch(cause_beyond(beyond), static_cast<std::uint16_t>(beyond), now_ns);
  return true;
}

bool AxisMaster::ignores_stop(std::int64_t now_ns) noexcept TANDEM_RT {
  const bool stops = target_ == TargetState::kNothing || target_ == TargetState::kQuickStop;
  if (!stops || age_cycles_ != 0 || !enabled()) return false;
  const std::int64_t most_ns =
      target_ == TargetState::kNothing ? kDisableTimeoutNs : kQuickStopTimeoutNs;
  // The samples after "disable voltage" count anew.
  const std::uint32_t least = target_ == TargetState::kNothing ? kObeyCycles : 2 * kObeyCycles;
  return ++disobedient_cycles_ > least && now_ns - since_ns_ >= most_ns;
}

bool AxisMaster::ignores_quick_stop(std::int64_t now_ns) const noexcept TANDEM_RT {
  return enabled() && disobedient_cycles_ > kObeyCycles &&
         now_ns - since_ns_ >= kQuickStopPatienceNs;
}

/// Without 605A = 2 a drive may stay in Quick Stop Active: it is let go when its ramp is over.
bool AxisMaster::rests_in_quick_stop(std::int64_t now_ns) const noexcept TANDEM_RT {
  return drive() == WireState::kQuickStopActive && age_cycles_ == 0 &&
         now_ns - since_ns_ >= kQuickStopRestNs &&
         std::abs(feedback_.velocity / scale_.velocity_per_rad_s) < kRestVelocity_rad_s;
}

/// In every mode of a drive that is enabled and wanted so.
ErrorCode AxisMaster::excess(std::int64_t now_ns) noexcept {
  const bool wanted = target_ == TargetState::kFollow || target_ == TargetState::kHold;
  const double dt_s = static_cast<double>(now_ns - watched_ns_) * 1e-9;
  if (wanted && enabled() && age_cycles_ != 0) return ErrorCode::kNone;
  watched_ns_ = now_ns;
  if (!wanted || !enabled() || dt_s <= 0.0) {
    motion_.rest();
    watched_mode_ = 0;
    return ErrorCode::kNone;
  }
  return motion_.look(motion_sample(dt_s), dt_s);
}

MotionSample AxisMaster::motion_sample(double dt_s) noexcept {
  using canopen::Mode;
  MotionSample sample{.velocity_rad_s = feedback_.velocity / scale_.velocity_per_rad_s,
                      .torque_Nm = feedback_.torque / scale_.mille_per_Nm};
  const auto mode = static_cast<Mode>(raw_.mode);
  const bool positions = mode == traits_.can.position;  // compliant: our boards watch
  const double error_rad = counts_to(raw_.target_position) / scale_.counts_per_rad;
  const double approached_rad = watched_error_rad_ - error_rad;
  watched_error_rad_ = error_rad;
  const bool shown = !traits_.tells_mode || feedback_.mode_display == raw_.mode;
  sample.follows =
      shown && watched_mode_ == raw_.mode && (positions || mode == traits_.can.velocity);
  watched_mode_ = shown ? raw_.mode : std::int64_t{0};
  sample.deviation_rad_s =
      positions ? approached_rad / dt_s
                : sample.velocity_rad_s - raw_.velocity_offset / scale_.velocity_per_rad_s;
  return sample;
}

/// In the position modes alone, and not while the drive changes its mode.
bool AxisMaster::lags(std::int64_t now_ns) noexcept {
  const bool positions = raw_.mode == static_cast<std::int8_t>(traits_.can.position);
  const bool shown = !traits_.tells_mode || feedback_.mode_display == raw_.mode;
  if (target_ != TargetState::kFollow || !was_enabled_ || !enabled() || !positions || !shown) {
    lag_.rest();
    return false;
  }
  if (age_cycles_ != 0) return false;
  // The last target is no nearer than the way between the last two: mostly that is all one needs.
  const double window_counts = lag_.window_rad() * std::abs(scale_.counts_per_rad);
  const bool near = std::abs(counts_to(raw_.target_position)) <= window_counts;
  return lag_.look(near ? 0.0 : position_error_rad(), now_ns);
}

/// From the joint's position; the counter may wrap around.
double AxisMaster::counts_to(std::int32_t target) const noexcept {
  return static_cast<std::int32_t>(static_cast<std::uint32_t>(target) -
                                   static_cast<std::uint32_t>(feedback_.position));
}

/// How far the joint is from the way between the last two targets: the last is in force since this
/// sample's SYNC, the one before had a cycle's time. Of the link and the motor the nearer counts: a
/// spring between them may sag.
double AxisMaster::position_error_rad() const noexcept {
  const auto outside = [](double from, double to) {
    return from * to <= 0.0 ? 0.0 : std::min(std::abs(from), std::abs(to));
  };
  const double last_rad = counts_to(raw_.target_position) / scale_.counts_per_rad;
  const double before_rad = counts_to(previous_target_) / scale_.counts_per_rad;
  const double link_rad = outside(before_rad, last_rad);
  if (!traits_.tells_motor) return link_rad;
  const double wound_rad = feedback_.motor_position / scale_.motor_counts_per_rad -
                           scale_.from_zero(feedback_.position) / scale_.counts_per_rad;
  return std::min(link_rad, outside(before_rad - wound_rad, last_rad - wound_rad));
}

void AxisMaster::latch(FaultCause error, std::uint16_t code,
                       std::int64_t now_ns) noexcept TANDEM_RT {
  error_ = error;
  asked_ = false;
  fault_code_ = code;
  trouble_ns_ = now_ns;
}

void AxisMaster::set_target(TargetState target, std::int64_t now_ns) noexcept TANDEM_RT {
  if (target == target_) return;
  homing_.interrupt();
  lag_.rest();
  const bool was_up = target_ == TargetState::kBringUp || target_ == TargetState::kEnable ||
                      target_ == TargetState::kHome;
  const bool goes_on = was_up && target == TargetState::kFollow;
  if (!goes_on) was_enabled_ = false;
  if (target == TargetState::kHold) {
    was_enabled_ = enabled();
    const bool follows = target_ == TargetState::kFollow &&
                         raw_.mode == static_cast<std::int8_t>(traits_.can.position);
    longest_step_ =
        follows ? step_from(previous_target_) + 1 : std::numeric_limits<std::int64_t>::max();
    if (!follows) {
      seed();
      aim_ = resting_place(feedback_.position, feedback_.velocity);
    }
  }
  if (target_ == TargetState::kHome && target == TargetState::kEnable) seed();
  if (target == TargetState::kReset || target == TargetState::kBringUp) emergency_code_ = 0;
  target_ = target;
  since_ns_ = now_ns;
  reset_cycles_ = 0;
  disobedient_cycles_ = 0;
}

bool AxisMaster::command(const CommandImage* image, std::size_t joint,
                         std::int64_t now_ns) noexcept TANDEM_RT {
  previous_target_ = raw_.target_position;
  if (!enabled()) {
    offers_ = false;
    last_set_point_ = kNoSetPoint;
  }
  switch (target_) {
    case TargetState::kNothing:
      raw_.controlword = controlword::kCommandDisableVoltage;
      return false;
    case TargetState::kQuickStop:
      raw_.controlword = ignores_quick_stop(now_ns) || rests_in_quick_stop(now_ns)
                             ? controlword::kCommandDisableVoltage
                             : controlword::kCommandQuickStop;
      return false;
    case TargetState::kHold:
      // A drive that is not enabled stays as it is: holding must not switch anything on.
      raw_.controlword = was_enabled_ ? enable_operation() : controlword::kCommandDisableVoltage;
      if (was_enabled_) brake(image, joint);
      return false;
    case TargetState::kBringUp: walk_up(true, now_ns); return enable_is_late(now_ns);
    case TargetState::kEnable: walk_up(false, now_ns); return enable_is_late(now_ns);
    case TargetState::kReset: raw_.controlword = reset_controlword(); return reset_is_late(now_ns);
    case TargetState::kHome: go_home(image, joint, now_ns); return false;
    case TargetState::kFollow:
      if (image != nullptr) follow(*image, joint, now_ns);
      return enable_is_late(now_ns);
  }
  return false;
}

void AxisMaster::follow(const CommandImage& image, std::size_t joint,
                        std::int64_t now_ns) noexcept {
  if (static_cast<ControlMode>(image.mode()[joint]) == ControlMode::kIdle) {
    raw_.controlword = controlword::kCommandShutdown;
    was_enabled_ = false;
    since_ns_ = now_ns;  // the time to be enabled again counts from the end of idling
    return;
  }
  if (was_enabled_ || enabled()) {
    was_enabled_ = true;
    encode(image, joint);
    raw_.controlword = enable_operation();
    return;
  }
  walk_up(false, now_ns);
}

/// As the loop says, as long as it only brakes: no cycle's way is longer than the one before.
void AxisMaster::brake(const CommandImage* image, std::size_t joint) noexcept TANDEM_RT {
  const RawCommand kept = raw_;
  if (image != nullptr && is_stiff_position(*image, joint)) {
    const std::int32_t aimed = aim_;
    encode(*image, joint);
    const std::int64_t step = step_from(kept.target_position);
    if (step <= longest_step_) {
      longest_step_ = std::min(longest_step_, step + 1);  // the targets are rounded
      return;
    }
    aim_ = aimed;
  }
  raw_ = kept;
  raw_.velocity_offset = 0;
}

/// Counts to the target; the counter may wrap around.
std::int64_t AxisMaster::step_from(std::int32_t target) const noexcept TANDEM_RT {
  return std::abs(std::int64_t{static_cast<std::int32_t>(
      static_cast<std::uint32_t>(raw_.target_position) - static_cast<std::uint32_t>(target))});
}

bool AxisMaster::home(std::int64_t timeout_ns, std::int64_t now_ns) noexcept TANDEM_RT {
  const bool follows = target_ == TargetState::kFollow && error_ == FaultCause::kNone && enabled();
  const bool again = target_ == TargetState::kHome && !homing_.under_way();
  if (!traits_.homes || !(follows || again)) return false;
  target_ = TargetState::kHome;
  since_ns_ = now_ns;
  was_enabled_ = true;
  was_idle_ = false;
  held_cycles_ = 0;
  homing_.begin(now_ns, timeout_ns);
  return true;
}

Homing AxisMaster::homing() const noexcept TANDEM_RT {
  if (!traits_.homes) return {};
  return {.state = homing_.under_way() ? HomingState::kHoming
                   : homing_.homed()   ? HomingState::kHomed
                                       : HomingState::kNotHomed,
          .error = homing_.error()};
}

void AxisMaster::go_home(const CommandImage* image, std::size_t joint,
                         std::int64_t now_ns) noexcept {
  constexpr auto kMode = static_cast<std::int8_t>(canopen::Mode::kHm);
  constexpr std::uint32_t kChange = 10;  // cycles that a drive may take to change its mode
  const bool idle =
      image != nullptr && static_cast<ControlMode>(image->mode()[joint]) == ControlMode::kIdle;
  was_idle_ = was_idle_ || idle;
  if (homing_.under_way()) {
    const bool shows = !traits_.tells_mode || feedback_.mode_display == kMode;
    seed();
    raw_.mode = kMode;
    raw_.controlword = homing_.step(feedback_.statusword, shows, now_ns);
    if (homing_.under_way()) return;
  }
  if (held_cycles_ < kChange) {
    ++held_cycles_;
    seed();
  }
  raw_.controlword = enable_operation();
  if (image == nullptr || !was_idle_ || idle) return;
  set_target(TargetState::kFollow, now_ns);
  follow(*image, joint, now_ns);
}

/// One transition nearer to Operation Enabled, with the measured position as target.
void AxisMaster::walk_up(bool clears_faults, std::int64_t now_ns) noexcept {
  const WireState state = drive();
  if (!heard_) {
    raw_.controlword = controlword::kCommandDisableVoltage;
    return;
  }
  if (enabled()) {
    was_enabled_ = true;
  } else {
    seed();  // until the drive follows; from then on the target stands
  }
  if (state == WireState::kFault && clears_faults) {
    raw_.controlword = reset_controlword();
  } else if (state == WireState::kQuickStopActive) {
    // The ramp ends by itself (605A = 2). A drive that stays, as 605A = 5 to 8 have it, is let go.
    const bool stays = now_ns - since_ns_ >= kQuickStopRestNs;
    raw_.controlword = stays ? controlword::kCommandDisableVoltage : controlword::kCommandQuickStop;
  } else if (state == WireState::kOperationEnabled) {
    raw_.controlword = enable_operation();
  } else {
    raw_.controlword = canopen::controlword_towards_enabled(state);
  }
}

/// Interpolated position waits for bit 4 before it follows, profile position for its edge.
std::uint16_t AxisMaster::enable_operation() noexcept {
  std::uint16_t bits = 0;
  if (raw_.mode == static_cast<std::int8_t>(canopen::Mode::kIp)) {
    bits = controlword::kEnableInterpolation;
  } else if (raw_.mode == static_cast<std::int8_t>(canopen::Mode::kPp)) {
    bits = hand_set_point_over();
  }
  return static_cast<std::uint16_t>(controlword::kCommandEnableOperation | bits);
}

/// One step of the handshake: bit 4 rises when the set-point has been on the wire for a cycle, and
/// falls when the drive has taken it (bit 12). From then until it rises again the wire has the
/// newest one.
std::uint16_t AxisMaster::hand_set_point_over() noexcept {
  const bool shown =
      !traits_.tells_mode || feedback_.mode_display == static_cast<std::int8_t>(canopen::Mode::kPp);
  const bool taken = (feedback_.statusword & canopen::statusword::kSetPointTaken) != 0;
  if (!shown || !enabled()) {
    offers_ = false;
    last_set_point_ = kNoSetPoint;
  } else if (offers_) {
    offers_ = !taken;
  } else if (!taken && last_set_point_ != set_point_) {
    offers_ = true;
    last_set_point_ = set_point_;
  }
  if (!offers_) set_point_ = aim_;
  return static_cast<std::uint16_t>(controlword::kChangeAtOnce |
                                    (offers_ ? controlword::kNewSetPoint : 0u));
}

void AxisMaster::encode(const CommandImage& image, std::size_t joint) noexcept {
  encode_command(scale_, traits_.can, image, joint, raw_);
  aim_ = resting_place(raw_.target_position, raw_.velocity_offset);
}

/// Where the joint would stand if it braked now. A drive that makes its own way to there passes the
/// reference's place with the reference's speed; and if nothing more comes, it stops there.
std::int32_t AxisMaster::resting_place(std::int32_t position,
                                       std::int32_t velocity) const noexcept {
  const double way_rad = traits_.profile.braking_way_rad(
      scale_.from_zero(position) / scale_.counts_per_rad, velocity / scale_.velocity_per_rad_s);
  const auto way = canopen::clamp_round<std::int32_t>(way_rad * scale_.counts_per_rad);
  return static_cast<std::int32_t>(static_cast<std::uint32_t>(position) +
                                   static_cast<std::uint32_t>(way));
}

/// Bit 7 off and on in turns: whenever the drive looks, there is an edge to come.
std::uint16_t AxisMaster::reset_controlword() noexcept {
  const bool set = (reset_cycles_++ / kResetToggleCycles) % 2 == 1;
  return set ? controlword::kCommandFaultReset : controlword::kCommandDisableVoltage;
}

void AxisMaster::seed() noexcept {
  raw_.mode = static_cast<std::int8_t>(canopen::first_mode(traits_.can));
  raw_.target_position = feedback_.position;
  aim_ = feedback_.position;
  if (!offers_) set_point_ = aim_;
  raw_.velocity_offset = 0;
  raw_.torque_offset = 0;
  raw_.target_voltage = 0;
  raw_.target_current = 0;
}

bool AxisMaster::enable_is_late(std::int64_t now_ns) noexcept {
  const bool late = !was_enabled_ && !enabled() && error_ == FaultCause::kNone &&
                    now_ns - since_ns_ >= kEnableTimeoutNs;
  if (!late) return false;
  const bool fault = drive() == WireState::kFault;
  const std::uint16_t code = feedback_.error_code;
  latch(fault ? FaultCause::kDrive : FaultCause::kNotEnabled,
        fault && code != 0 ? code : static_cast<std::uint16_t>(ErrorCode::kGeneric), now_ns);
  return true;
}

bool AxisMaster::reset_is_late(std::int64_t now_ns) noexcept {
  return in_reset() && now_ns - since_ns_ >= kResetTimeoutNs;
}

/// A drive that is still enabled does not hear its commands.
bool AxisMaster::in_reset() const noexcept TANDEM_RT {
  const WireState state = drive();
  return state == WireState::kFault || state == WireState::kFaultReactionActive ||
         state == WireState::kOperationEnabled;
}

bool AxisMaster::off() const noexcept TANDEM_RT {
  switch (drive()) {
    case WireState::kOperationEnabled:
    case WireState::kQuickStopActive:
    case WireState::kFaultReactionActive: return !heard_;
    default: return true;
  }
}

void AxisMaster::fill(StateImage& state, std::size_t joint) const noexcept TANDEM_RT {
  if (heard_) {
    decode_feedback(scale_, feedback_, joint, state);
    if (!traits_.tells_mode && enabled()) {
      const auto [mode, interaction] = image_mode(raw_.mode);
      state.mode()[joint] = static_cast<std::int8_t>(mode);
      state.interaction()[joint] = static_cast<std::uint8_t>(interaction);
    }
    if (!traits_.tells_motor) {
      state.motor_position_rad()[joint] = state.position_rad()[joint];
      state.motor_velocity_rad_s()[joint] = state.velocity_rad_s()[joint];
    }
  } else {
    state.drive_state()[joint] = static_cast<std::uint8_t>(DriveState::kUnknown);
    state.mode()[joint] = static_cast<std::int8_t>(ControlMode::kIdle);
  }
  state.homing()[joint] = static_cast<std::uint8_t>(homing().state);
  state.acceleration_rad_s2()[joint] = acceleration_rad_s2_;
  state.age_cycles()[joint] = age_cycles_;
  state.fault()[joint] = error_ != FaultCause::kNone ? fault_code_ : 0u;
}

void AxisMaster::forget() noexcept TANDEM_RT {
  feedback_ = {};
  homing_.forget();
  heard_ = false;
  was_enabled_ = false;
  emergency_code_ = 0;
  acceleration_rad_s2_ = 0.0;
}

void AxisMaster::archive(Archive& ar) {
  ar(motion_, watched_error_rad_, watched_ns_, watched_mode_);
  ar(homing_, was_idle_, held_cycles_, lag_, previous_target_, longest_step_, asked_,
     disobedient_cycles_);
  ar(feedback_, raw_, target_, error_, heard_, was_enabled_, fault_code_, emergency_code_,
     age_cycles_, reset_cycles_, previous_velocity_, sample_ns_, trouble_ns_, since_ns_,
     acceleration_rad_s2_, scale_.zero_counts);
  ar(aim_, set_point_, last_set_point_, offers_, last_emergency_);
}

}  // namespace tandem::hal::can
