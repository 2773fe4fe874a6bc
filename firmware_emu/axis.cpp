// One control period of an axis: sample, protections, drive machine with its brake times, joint
// controller; and the checks of what SDOs write to its objects.
#include "firmware_emu/axis.hpp"

#include <bit>
#include <cmath>
#include <utility>

#include "canopen/bytes.hpp"

namespace tandem::firmware {

namespace {

using namespace canopen;

constexpr double kRestVelocity_rad_s = 0.05;  // of the motor, reflected to the link
constexpr double kRestTime_s = 0.02;
constexpr double kSlower_rad_s = 0.01;  // what counts as having become slower

constexpr double kSwitch_rad = 0.005;  // homing's switches: before the ends of the range

/// Modes in which a drive makes its own way to a target.
constexpr std::uint32_t kProfileModes =
    mode_bit(Mode::kPp) | mode_bit(Mode::kPv) | mode_bit(Mode::kTq) | mode_bit(Mode::kHm);

/// The object's index as it is on axis 0.
std::uint16_t on_axis_0(std::uint16_t index) noexcept {
  const std::uint16_t base = index >= 0x6000 ? 0x6000 : 0x2000;
  return static_cast<std::uint16_t>(base + (index - base) % kAxisStride);
}

}  // namespace

Axis::Axis(const AxisSetup& setup, const BoardSetup& board, int index, ObjectDictionary& od)
    : period_s_(static_cast<double>(board.control_period_ns) * 1.0e-9),
      modes_(setup.modes),
      reversed_(setup.reversed),
      velocity_units_(setup.velocity_units_per_rev > 0.0
                          ? setup.velocity_units_per_rev / setup.parameters.link_counts_per_rev
                          : 1.0),
      acceleration_units_(setup.acceleration_units_per_rev > 0.0
                              ? setup.acceleration_units_per_rev /
                                    setup.parameters.link_counts_per_rev
                              : velocity_units_),
      stands_in_(board.sheet != nullptr),
      zero_at_power_on_(setup.zero_counts),
      zero_counts_(setup.zero_counts),
      turn_counts_(setup.turn_counts),
      home_switch_from_rad_(setup.home_switch_from_rad),
      home_switch_to_rad_(setup.home_switch_to_rad),
      index_rad_(setup.index_rad),
      index_pitch_rad_(setup.index_pitch_rad),
      counts_from_power_on_(setup.counts_from_power_on),
      at_power_on_(setup.counts_from_power_on || setup.turn_counts != 0),
      power_on_(setup.parameters),
      torque_sensor_({.noise = setup.torque_noise_Nm, .quantum = setup.torque_quantum_Nm},
                     NoiseGenerator::stream(board.seed, static_cast<std::uint64_t>(index))) {
  objects_.set(power_on_);
  objects_.add_to(od, index, *this);
  profile_.allow_homing(setup.homing_methods);
  if ((modes_ & kProfileModes) != 0) profile_.add_to(od, index, modes_);
  apply_settings();
  take_demands();
}

void Axis::power_on() noexcept TANDEM_RT {
  objects_ = {};
  objects_.set(power_on_);
  zero_counts_ = zero_at_power_on_;
  at_power_on_ = counts_from_power_on_ || turn_counts_ != 0;
  profile_.power_on();
  profiled_ = {};
  machine_.reset();
  protection_ = {};
  mode_ = Mode::kNone;
  index_turn_ = kNoTurn;
  stopping_s_ = 0.0;
  resting_s_ = 0.0;
  slowest_rad_s_ = 0.0;
  stalled_s_ = 0.0;
  brake_periods_ = 0;
  stop_ = DriveMotion::kNone;
  apply_settings();
  take_demands();
}

void Axis::apply_settings() noexcept TANDEM_RT {
  DriveParameters& now = parameters_;
  now = objects_.parameters();
  if (stands_in_) {
    now.link_counts_per_rev = power_on_.link_counts_per_rev;
    now.motor_counts_per_rev = power_on_.motor_counts_per_rev;
    now.rated_torque_Nm = power_on_.rated_torque_Nm;
  }
  controller_.configure(now, period_s_);
  link_encoder_.set_resolution(now.link_counts_per_rev);
  motor_encoder_.set_resolution(now.motor_counts_per_rev);
  link_velocity_.configure(now.link_velocity_cutoff_Hz, period_s_);
  motor_velocity_.configure(now.motor_velocity_cutoff_Hz, period_s_);
  torque_rate_.configure(now.torque_rate_cutoff_Hz, period_s_);
  settings_changed_ = false;
}

void Axis::sample(const AxisSense& sense) noexcept TANDEM_RT {
  if (settings_changed_) apply_settings();
  objects_.digital_inputs = sense.emergency_stop ? canopen::digital_input::kInterlock : 0;
  const bool link_valid = link_encoder_.sample(sense.link_position_rad);
  const bool motor_valid = motor_encoder_.sample(sense.motor_position_rad);
  if (motor_valid) {  // by itself: a stop ends when the motor rests
    measured_.motor_position_rad = motor_encoder_.position_rad();
    measured_.motor_velocity_rad_s = motor_velocity_.update(measured_.motor_position_rad);
  }
  sensors_valid_ = std::isfinite(sense.spring_torque_Nm) && std::isfinite(sense.current_A) &&
                   std::isfinite(sense.temperature_C) && std::isfinite(sense.bus_voltage_V) &&
                   link_valid && motor_valid;
  if (!sensors_valid_) return;  // the last good values stay, and a fault follows
  const double velocity_before = measured_.link_velocity_rad_s;
  if (at_power_on_) {
    zero_counts_ = zero_at_power_on_;
    const std::int32_t count = to_wire(link_encoder_.counts());
    const std::int32_t shown = counts_from_power_on_ ? zero_at_power_on_ : within_turn(count);
    zero_counts_ = static_cast<std::int32_t>(static_cast<std::uint32_t>(zero_at_power_on_) +
                                             static_cast<std::uint32_t>(shown) -
                                             static_cast<std::uint32_t>(count));
    at_power_on_ = false;
  }
  measured_.link_position_rad = link_encoder_.position_rad();
  measured_.link_velocity_rad_s = link_velocity_.update(measured_.link_position_rad);
  measured_.link_acceleration_rad_s2 =
      (measured_.link_velocity_rad_s - velocity_before) / period_s_;
  measured_.torque_Nm = torque_sensor_.sample(sense.spring_torque_Nm);
  measured_.torque_rate_Nm_s = torque_rate_.update(measured_.torque_Nm);
  measured_.current_A = sense.current_A;
  measured_.bus_voltage_V = sense.bus_voltage_V;
  temperature_C_ = sense.temperature_C;
  show_actual();
}

bool Axis::supported(std::int8_t mode) const noexcept {
  if (mode == 0) return true;
  const int bit = mode > 0 ? mode - 1 : 15 - mode;  // the manufacturer's from bit 16
  return bit < 32 && (modes_ >> bit & 1U) != 0;
}

std::int32_t Axis::within_turn(std::int32_t count) const noexcept {
  const std::int32_t rest = count % turn_counts_;
  return rest < 0 ? rest + turn_counts_ : rest;
}

std::int32_t Axis::to_wire(std::int64_t counts) const noexcept {
  const auto low = static_cast<std::uint32_t>(reversed_ ? -counts : counts);
  return static_cast<std::int32_t>(low + static_cast<std::uint32_t>(zero_counts_));
}

std::int32_t Axis::from_wire(std::int32_t value) const noexcept {
  const std::uint32_t counts =
      static_cast<std::uint32_t>(value) - static_cast<std::uint32_t>(zero_counts_);
  return static_cast<std::int32_t>(reversed_ ? 0U - counts : counts);
}

double Axis::shown_shift_rad() const noexcept {
  const auto counts = static_cast<std::int32_t>(static_cast<std::uint32_t>(zero_counts_) -
                                                static_cast<std::uint32_t>(zero_at_power_on_));
  return (reversed_ ? -counts : counts) * link_encoder_.rad_per_count();
}

void Axis::show_actual() noexcept {
  AxisObjects& o = objects_;
  const double sign = reversed_ ? -1.0 : 1.0;
  o.position = to_wire(link_encoder_.counts());
  o.velocity = clamp_round<std::int32_t>(sign * measured_.link_velocity_rad_s *
                                         link_encoder_.counts_per_rad() * velocity_units_);
  o.motor_position = static_cast<std::int32_t>(
      motor_encoder_.counts() +
      clamp_round<std::int32_t>(shown_shift_rad() * motor_encoder_.counts_per_rad()));
  o.motor_velocity =
      clamp_round<std::int32_t>(measured_.motor_velocity_rad_s * motor_encoder_.counts_per_rad());
  o.torque =
      clamp_round<std::int16_t>(sign * measured_.torque_Nm * 1.0e3 / parameters_.rated_torque_Nm);
  o.current = clamp_round<std::int16_t>(measured_.current_A * 100.0);
  o.temperature = clamp_round<std::int16_t>(temperature_C_ * 10.0);
}

void Axis::take_demands() noexcept {
  if (supported(objects_.mode)) {
    if (objects_.mode != 0) mode_ = static_cast<Mode>(objects_.mode);
  } else {
    objects_.mode = static_cast<std::int8_t>(mode_);
    ++objects_.refused_values;
  }
  objects_.mode_display = static_cast<std::int8_t>(mode_);
  // By PDO these come unchecked.
  const auto take = [this](std::uint32_t& object, double& value) {
    const auto asked = std::bit_cast<float>(object);
    if (std::isfinite(asked) && asked >= 0.0F) {
      value = asked;
    } else {
      object = std::bit_cast<std::uint32_t>(static_cast<float>(value));
      ++objects_.refused_values;
    }
  };
  take(objects_.settings[drive_row(canopen::object::kStiffness, 0)], stiffness_Nm_rad_);
  take(objects_.settings[drive_row(canopen::object::kDamping, 0)], damping_Nms_rad_);
}

ErrorCode Axis::present_cause(ErrorCode connection) noexcept {
  const bool follows =
      machine_.motion() == DriveMotion::kFollow && ProfileModes::cyclic(mode_) == Mode::kCsp;
  const ErrorCode cause = protection_.update(
      parameters_,
      {.link_position_rad = measured_.link_position_rad,
       .position_error_rad = controller_.terms().position_error_rad,
       .current_A = measured_.current_A,
       .temperature_C = temperature_C_,
       .bus_voltage_V = measured_.bus_voltage_V,
       .mismatch_rad = mismatch_rad(),
       .motor_torque_Nm = parameters_.motor_constant_Nm_A * measured_.current_A,
       .link_velocity_rad_s = measured_.link_velocity_rad_s,
       .motor_velocity_rad_s = measured_.motor_velocity_rad_s,
       .torque_Nm = measured_.torque_Nm,
       .deviation_rad_s = controller_.terms().deviation_rad_s,
       .asked_torque_Nm = controller_.terms().torque_reference_Nm,
       .follows_motion = controller_.follows_motion(),
       .sensors_valid = sensors_valid_,
       .powered = powered(),
       .drives = action() != BridgeAction::kOff && action() != BridgeAction::kBrake,
       .follows_position = follows},
      period_s_);
  const bool interlock = (objects_.digital_inputs & canopen::digital_input::kInterlock) != 0;
  if (interlock) return ErrorCode::kEmergencyInput;
  if (cause != ErrorCode::kNone) return cause;
  // A lost connection is a fault of an axis that runs, and stays one until it is back.
  const bool latched = objects_.error_code == static_cast<std::uint16_t>(connection);
  return powered() || latched ? connection : ErrorCode::kNone;
}

double Axis::mismatch_rad() const noexcept {
  const double spring = parameters_.spring_Nm_rad;
  const double twist = spring > 0.0 ? measured_.torque_Nm / spring : 0.0;
  return measured_.motor_position_rad - measured_.link_position_rad - twist;
}

AxisEvents Axis::supervise(ErrorCode connection, bool heartbeat_lost) noexcept TANDEM_RT {
  take_demands();
  if (heartbeat_lost && objects_.abort_option == 1) {
    connection = ErrorCode::kHeartbeatLost;
  } else if (heartbeat_lost) {
    machine_.abort_connection(objects_.abort_option, objects_.options);
  }
  const ErrorCode cause = present_cause(connection);
  watch_stop();
  const bool profile = ProfileModes::has(mode_);
  const DriveMachineState before = machine_.state();
  const bool brake_was_set = machine_.brake_set();
  const DriveMachineState now = machine_.step(
      objects_.controlword,
      {.fault = cause != ErrorCode::kNone,
       .at_rest = stopped(),
       .standstill = resting_s_ >= kRestTime_s,
       .internal_limit = controller_.limited(),
       .follows_command = profile ? profiled_.bit_12 : mode_ != Mode::kNone,
       .following_error = mode_ == Mode::kHm ? profiled_.bit_13 : protection_.lagging(),
       .target_reached = profile && profiled_.target_reached,
       .warning = protection_.warning(parameters_),
       .has_brake = has_brake(),
       .brake_moved = brake_moved()},
      objects_.options);
  objects_.statusword = machine_.statusword();
  watch_brake(brake_was_set);

  AxisEvents events;
  // Once it rests, and whenever a reset is asked for, the fault is what is there now: it may be
  // another cause than the one that was found first. Of a connection the first loss is the cause.
  const bool asks = (objects_.controlword & canopen::controlword::kFaultReset) != 0;
  const bool settled = now == DriveMachineState::kFault && (before != now || asks) &&
                       cause != ErrorCode::kNone && cause != connection;
  if ((now == DriveMachineState::kFaultReactionActive && before != now) ||
      (settled && objects_.error_code != static_cast<std::uint16_t>(cause))) {
    events.raised = cause;
    objects_.error_code = static_cast<std::uint16_t>(cause);
  }
  if (machine_.fault_was_reset()) {
    events.reset = true;
    objects_.error_code = 0;
  }
  if (now == DriveMachineState::kOperationEnabled && before != now) {
    seed_references();
    profile_.forget_target();
  }
  index_turn_ = profile ? index_turn_ : kNoTurn;
  if (profile) run_profile();
  return events;
}

HomingSenses Axis::senses() noexcept {
  if (mode_ != Mode::kHm) return {};
  const double at_rad = measured_.link_position_rad;
  const bool at_min = at_rad <= parameters_.min_position_rad + kSwitch_rad;
  const bool at_max = at_rad >= parameters_.max_position_rad - kSwitch_rad;
  HomingSenses seen{
      .at_low_switch = reversed_ ? at_max : at_min,
      .at_high_switch = reversed_ ? at_min : at_max,
      .at_home_switch = at_rad >= home_switch_from_rad_ && at_rad <= home_switch_to_rad_};
  if (index_pitch_rad_ <= 0.0) return seen;
  const std::int64_t turn = static_cast<std::int64_t>(
      std::floor((measured_.motor_position_rad - index_rad_) / index_pitch_rad_));
  const std::int64_t before = std::exchange(index_turn_, turn);
  if (before != kNoTurn && turn != before) seen.index = (turn > before) == reversed_ ? -1 : 1;
  return seen;
}

void Axis::run_profile() noexcept {
  const AxisObjects& o = objects_;
  profiled_ = profile_.step({.mode = mode_,
                             .controlword = o.controlword,
                             .follows = machine_.motion() == DriveMotion::kFollow,
                             .position = o.position,
                             .target_position = o.target_position,
                             .target_velocity = o.target_velocity,
                             .velocity_units = velocity_units_,
                             .acceleration_units = acceleration_units_,
                             .target_torque = o.target_torque,
                             .torque = o.torque,
                             .senses = senses()},
                            period_s_);
  if (!profiled_.homed) return;
  const std::int32_t counts = from_wire(o.position);
  zero_counts_ = 0;
  zero_counts_ = static_cast<std::int32_t>(static_cast<std::uint32_t>(profile_.home_offset()) -
                                           static_cast<std::uint32_t>(to_wire(counts)));
  objects_.position = to_wire(counts);
  objects_.target_position = objects_.position;
}

// The axis holds where it is until a command says otherwise.
void Axis::seed_references() noexcept {
  objects_.target_position = objects_.position;
  objects_.target_velocity = 0;
  objects_.velocity_offset = 0;
}

void Axis::watch_stop() noexcept {
  const bool stops =
      machine_.motion() != DriveMotion::kNone && machine_.motion() != DriveMotion::kFollow;
  if (machine_.motion() != stop_) resting_s_ = 0.0;
  stop_ = machine_.motion();
  const bool rests = std::abs(measured_.motor_velocity_rad_s) < kRestVelocity_rad_s;
  stopping_s_ = stops ? stopping_s_ + period_s_ : 0.0;
  resting_s_ = stops && rests ? resting_s_ + period_s_ : 0.0;
  const double speed = std::abs(measured_.motor_velocity_rad_s);
  const bool slower = stopping_s_ <= period_s_ || speed < slowest_rad_s_ - kSlower_rad_s;
  if (slower) slowest_rad_s_ = speed;
  stalled_s_ = stops && !slower ? stalled_s_ + period_s_ : 0.0;
}

// Gravity keeps a shorted motor turning: a brake need not wait for a rest that does not come.
bool Axis::stopped() const noexcept {
  return resting_s_ >= kRestTime_s || stopping_s_ >= parameters_.stop_time_s ||
         (has_brake() && stalled_s_ >= kRestTime_s);
}

bool Axis::brake_moved() const noexcept {
  const double takes_ms =
      machine_.brake_set() ? parameters_.brake_engage_ms : parameters_.brake_release_ms;
  constexpr double kRounding = 1.0e-6;  // a time of whole periods takes no more of them
  const double periods = takes_ms * 1.0e-3 / period_s_;
  return static_cast<double>(brake_periods_) >= periods - kRounding;
}

void Axis::watch_brake(bool was_set) noexcept {
  const bool set = machine_.brake_set();
  brake_periods_ = set == was_set ? brake_periods_ + 1 : 1;
  const bool shown = set && has_brake();
  objects_.digital_outputs = shown ? canopen::digital_output::kSetBrake : 0;
}

BridgeAction Axis::action() const noexcept {
  switch (machine_.motion()) {
    case DriveMotion::kNone: return BridgeAction::kOff;
    case DriveMotion::kFollow:
      return mode_ == Mode::kNone ? BridgeAction::kBrake : BridgeAction::kFollow;
    case DriveMotion::kSlowDown: return can_ramp() ? BridgeAction::kHold : BridgeAction::kBrake;
    case DriveMotion::kQuickStop: return can_ramp() ? BridgeAction::kRamp : BridgeAction::kBrake;
    case DriveMotion::kShorted: return BridgeAction::kBrake;
  }
  return BridgeAction::kOff;
}

// A stop by the position loop needs its gain, the sensors and the supply, and a loop that is not
// itself the fault.
bool Axis::can_ramp() const noexcept {
  if (!sensors_valid_ || !(parameters_.position.kp > 0.0)) return false;
  if (machine_.state() != DriveMachineState::kFaultReactionActive) return true;
  switch (static_cast<ErrorCode>(objects_.error_code)) {
    case ErrorCode::kPositionSensor:
    case ErrorCode::kSensorMismatch:
    case ErrorCode::kVoltage:
    case ErrorCode::kOscillation:
    case ErrorCode::kVelocityControl:
    case ErrorCode::kFollowingError: return false;
    default: return true;
  }
}

Reference Axis::reference() const noexcept {
  const AxisObjects& o = objects_;
  const double sign = reversed_ ? -1.0 : 1.0;
  const double rad = link_encoder_.rad_per_count();
  const double Nm = parameters_.rated_torque_Nm * 1.0e-3;
  const bool profile = ProfileModes::has(mode_);
  const bool by_velocity = mode_ == Mode::kCsv || mode_ == Mode::kVelocityImpedance;
  const std::int64_t asked =
      std::int64_t{o.velocity_offset} + (by_velocity ? o.target_velocity : 0);
  const double velocity =
      static_cast<double>(asked) / velocity_units_ + (profile ? profiled_.velocity : 0);
  const int torque = o.torque_offset + (profile               ? profiled_.torque
                                        : mode_ == Mode::kCst ? o.target_torque
                                                              : 0);
  return {.position_rad = from_wire(profile ? profiled_.position : o.target_position) * rad,
          .velocity_rad_s = sign * (velocity * rad),
          .torque_Nm = sign * (torque * Nm),
          .voltage_V = o.target_voltage * 0.01,
          .current_A = o.target_current * 0.01,
          .stiffness_Nm_rad = stiffness_Nm_rad_,
          .damping_Nms_rad = damping_Nms_rad_};
}

AxisDrive Axis::control() noexcept TANDEM_RT {
  const BridgeAction doing = action();
  const double voltage_V =
      controller_.update(doing, ProfileModes::cyclic(mode_), reference(), measured_);
  show_controller();
  return {.voltage_V = voltage_V,
          .enabled = doing != BridgeAction::kOff,
          .brake_open = !machine_.brake_set()};
}

void Axis::show_controller() noexcept {
  const JointController::Terms& terms = controller_.terms();
  objects_.voltage = clamp_round<std::int16_t>(terms.voltage_V * 100.0);
  objects_.following_error = clamp_round<std::int32_t>(
      (reversed_ ? -1.0 : 1.0) * terms.position_error_rad * link_encoder_.counts_per_rad());
  objects_.telemetry = {static_cast<float>(terms.torque_reference_Nm),
                        static_cast<float>(terms.transfer_V),
                        static_cast<float>(controller_.position_loop().state.i),
                        static_cast<float>(controller_.velocity_loop().state.i),
                        static_cast<float>(controller_.torque_loop().state.i),
                        static_cast<float>(controller_.electrical_loop().state.i),
                        static_cast<float>(protection_.load(parameters_)),
                        static_cast<float>(protection_.oscillation(parameters_))};
}

AbortCode Axis::check(const ObjectEntry& entry, const std::uint8_t* bytes) noexcept TANDEM_RT {
  switch (on_axis_0(entry.index)) {
    case canopen::object::kMode:
      return supported(static_cast<std::int8_t>(bytes[0])) ? AbortCode::kNone : AbortCode::kRange;
    case canopen::object::kQuickStopOption:
      return get<std::int16_t>(bytes) == 3 || get<std::int16_t>(bytes) == 4 ? AbortCode::kRange
                                                                            : AbortCode::kNone;
    case canopen::object::kSoftwareLimits: return check_limits(entry, bytes);
    case canopen::object::kEncoderResolution:
    case canopen::object::kMotorResolution:
    case canopen::object::kRatedTorque:  // they give every position and torque its meaning
    case canopen::object::kBrake: return powered() ? AbortCode::kDeviceState : AbortCode::kNone;
    default: return AbortCode::kNone;
  }
}

AbortCode Axis::check_limits(const ObjectEntry& entry, const std::uint8_t* bytes) const noexcept {
  constexpr std::size_t kMin = drive_row(canopen::object::kSoftwareLimits, 1);
  const auto limit = get<std::int32_t>(bytes);
  const auto other = static_cast<std::int32_t>(objects_.settings[entry.sub == 1 ? kMin + 1 : kMin]);
  const bool inverted = entry.sub == 1 ? limit > other : limit < other;
  return inverted ? AbortCode::kMaxBelowMin : AbortCode::kNone;
}

void Axis::written(const ObjectEntry& entry) noexcept TANDEM_RT {
  switch (on_axis_0(entry.index)) {
    case canopen::object::kMode:
    case canopen::object::kQuickStopOption:
    case canopen::object::kStiffness:
    case canopen::object::kDamping: return;  // read where they are used
    default: settings_changed_ = true;
  }
}

void Axis::archive(Archive& ar) {
  bool changed = settings_changed_;
  ar(objects_, changed);
  if (ar.reading()) apply_settings();
  settings_changed_ = changed;
  profile_.archive(ar);
  ar(zero_counts_, at_power_on_, profiled_.position, profiled_.velocity, profiled_.torque,
     profiled_.target_reached, profiled_.bit_12, profiled_.bit_13, profiled_.homed);
  ar(controller_, protection_, machine_, link_encoder_, motor_encoder_, torque_sensor_,
     link_velocity_, motor_velocity_, torque_rate_, measured_, temperature_C_, stiffness_Nm_rad_,
     damping_Nms_rad_, stopping_s_, resting_s_, slowest_rad_s_, stalled_s_, brake_periods_, stop_,
     mode_, index_turn_, sensors_valid_);
}

}  // namespace tandem::firmware
