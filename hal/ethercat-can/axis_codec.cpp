// Scaling between SI units and CiA 402 integers, per field; rounds to the nearest and clamps. NaN
// becomes 0.
#include "hal/ethercat-can/axis_codec.hpp"

#include <cmath>
#include <numbers>

#include "base/archive.hpp"
#include "canopen/bytes.hpp"
#include "canopen/drive_abilities.hpp"

namespace tandem::hal::can {

using canopen::clamp_round;
using canopen::Mode;

namespace {

// An image takes the bus' drive states as they are numbered.
static_assert(static_cast<int>(canopen::DriveMachineState::kNotReadyToSwitchOn) ==
                  static_cast<int>(DriveState::kNotReadyToSwitchOn) &&
              static_cast<int>(canopen::DriveMachineState::kFault) ==
                  static_cast<int>(DriveState::kFault));

/// A gain on the wire: a number, whatever the caller computed.
float real32(double value) noexcept {
  constexpr double kMax = 3.4e38;
  if (!(value == value)) return 0.0F;
  return static_cast<float>(value > kMax ? kMax : value < -kMax ? -kMax : value);
}

}  // namespace

namespace {

AxisScale scale_of(const JointConfig& joint, double counts, double motor_counts, double rated_mNm) {
  constexpr double kRadPerRev = 2.0 * std::numbers::pi;
  const double sign = joint.reversed ? -1.0 : 1.0;
  const double velocities =
      joint.velocity_units_per_rev > 0.0 ? joint.velocity_units_per_rev : counts;
  const double accelerations =
      joint.acceleration_units_per_rev > 0.0 ? joint.acceleration_units_per_rev : velocities;
  return {.counts_per_rad = sign * counts / kRadPerRev,
          .velocity_per_rad_s = sign * velocities / kRadPerRev,
          .acceleration_per_rad_s2 = sign * accelerations / kRadPerRev,
          .motor_counts_per_rad = motor_counts / kRadPerRev,
          .mille_per_Nm = sign * 1.0e6 / rated_mNm,
          .zero_counts = joint.zero_counts,
          .turn_counts = joint.encoder_turn_counts,
          .middle_counts =
              clamp_round<std::int32_t>(0.5 * (joint.min_position_rad + joint.max_position_rad) *
                                        sign * counts / kRadPerRev)};
}

}  // namespace

void AxisScale::find_turn(std::int32_t count) noexcept TANDEM_RT {
  if (turn_counts == 0) return;
  const std::int64_t from_middle = std::int64_t{from_zero(count)} - middle_counts;
  const std::int64_t half = turn_counts / 2;
  const std::int64_t shifted = from_middle + half;
  const std::int64_t turns = (shifted >= 0 ? shifted : shifted - turn_counts + 1) / turn_counts;
  zero_counts = static_cast<std::int32_t>(static_cast<std::uint32_t>(zero_counts) +
                                          static_cast<std::uint32_t>(turns * turn_counts));
}

AxisScale AxisScale::of(const JointConfig& joint) {
  return scale_of(joint, clamp_round<std::uint32_t>(joint.encoder_counts_per_rev),
                  clamp_round<std::uint32_t>(joint.motor_encoder_counts_per_rev),
                  clamp_round<std::uint32_t>(1000.0 * joint.rated_torque_Nm));
}

AxisScale AxisScale::of(const RobotConfig& robot, const JointConfig& joint) {
  const BoardConfig* board = robot.board(joint.board);
  const bool settings =
      board == nullptr || canopen::abilities_of(*board->sheet, joint.axis).settings;
  if (settings) return of(joint);  // it takes our scales, as whole numbers
  return scale_of(joint, joint.encoder_counts_per_rev, joint.motor_encoder_counts_per_rev,
                  1000.0 * joint.rated_torque_Nm);
}

void* RawFeedback::variable(WireField field) noexcept {
  switch (field) {
    case WireField::kStatusword: return &statusword;
    case WireField::kPosition: return &position;
    case WireField::kVelocity: return &velocity;
    case WireField::kTorque: return &torque;
    case WireField::kMotorPosition: return &motor_position;
    case WireField::kMotorVelocity: return &motor_velocity;
    case WireField::kCurrent: return &current;
    case WireField::kVoltage: return &voltage;
    case WireField::kTemperature: return &temperature;
    case WireField::kModeDisplay: return &mode_display;
    case WireField::kErrorCode: return &error_code;
    default: return nullptr;
  }
}

void RawFeedback::adopt(const RawFeedback& sample) noexcept TANDEM_RT {
  statusword = sample.statusword;
  position = sample.position;
  velocity = sample.velocity;
  torque = sample.torque;
  motor_position = sample.motor_position;
}

void* RawCommand::variable(WireField field) noexcept {
  switch (field) {
    case WireField::kControlword: return &controlword;
    case WireField::kMode: return &mode;
    case WireField::kTargetPosition: return &target_position;
    case WireField::kVelocityOffset: return &velocity_offset;
    case WireField::kTorqueOffset: return &torque_offset;
    case WireField::kTargetVoltage: return &target_voltage;
    case WireField::kTargetCurrent: return &target_current;
    case WireField::kStiffness: return &stiffness;
    case WireField::kDamping: return &damping;
    default: return nullptr;
  }
}

Mode wire_mode(ControlMode mode, InteractionMode interaction,
               const canopen::DriveAbilities& can) noexcept TANDEM_RT {
  const Mode velocity = can.velocity == Mode::kPv ? Mode::kPv : Mode::kCsv;
  const bool compliant = interaction == InteractionMode::kCompliant;
  switch (mode) {
    case ControlMode::kIdle: return Mode::kNone;
    case ControlMode::kPosition: return compliant ? Mode::kImpedance : can.position;
    case ControlMode::kVelocity: return compliant ? Mode::kVelocityImpedance : velocity;
    case ControlMode::kTorque: return Mode::kCst;
    case ControlMode::kOpenLoop: return Mode::kOpenLoop;
    case ControlMode::kCurrent: return Mode::kCurrent;
  }
  return Mode::kNone;
}

std::pair<ControlMode, InteractionMode> image_mode(std::int8_t mode) noexcept TANDEM_RT {
  constexpr auto kStiff = InteractionMode::kStiff;
  switch (static_cast<Mode>(mode)) {
    case Mode::kPp:
    case Mode::kIp:
    case Mode::kCsp: return {ControlMode::kPosition, kStiff};
    case Mode::kImpedance: return {ControlMode::kPosition, InteractionMode::kCompliant};
    case Mode::kPv:
    case Mode::kCsv: return {ControlMode::kVelocity, kStiff};
    case Mode::kVelocityImpedance: return {ControlMode::kVelocity, InteractionMode::kCompliant};
    case Mode::kCst: return {ControlMode::kTorque, kStiff};
    case Mode::kOpenLoop: return {ControlMode::kOpenLoop, kStiff};
    case Mode::kCurrent: return {ControlMode::kCurrent, kStiff};
    case Mode::kTq:
    case Mode::kHm:
    case Mode::kNone: break;
  }
  return {ControlMode::kIdle, kStiff};
}

void encode_command(const AxisScale& scale, const canopen::DriveAbilities& can,
                    const CommandImage& command, std::size_t joint,
                    RawCommand& raw) noexcept TANDEM_RT {
  const auto mode = static_cast<ControlMode>(command.mode()[joint]);
  const auto interaction = static_cast<InteractionMode>(command.interaction()[joint]);
  const Mode wire = wire_mode(mode, interaction, can);
  if (wire != Mode::kNone) raw.mode = static_cast<std::int8_t>(wire);
  raw.target_position = scale.to_drive(
      clamp_round<std::int32_t>(command.position_rad()[joint] * scale.counts_per_rad));
  raw.velocity_offset =
      clamp_round<std::int32_t>(command.velocity_rad_s()[joint] * scale.velocity_per_rad_s);
  raw.torque_offset = clamp_round<std::int16_t>(command.torque_Nm()[joint] * scale.mille_per_Nm);
  raw.target_voltage = clamp_round<std::int16_t>(command.voltage_V()[joint] / kVoltPerUnit);
  raw.target_current = clamp_round<std::int16_t>(command.current_A()[joint] / kAmperePerUnit);
  raw.stiffness = real32(command.stiffness_Nm_rad()[joint]);
  raw.damping = real32(command.damping_Nms_rad()[joint]);
}

void decode_feedback(const AxisScale& scale, const RawFeedback& raw, std::size_t joint,
                     StateImage& state) noexcept TANDEM_RT {
  const double rad = 1.0 / scale.counts_per_rad;
  const double motor_rad = 1.0 / scale.motor_counts_per_rad;
  state.position_rad()[joint] = scale.from_zero(raw.position) * rad;
  state.velocity_rad_s()[joint] = raw.velocity * (1.0 / scale.velocity_per_rad_s);
  state.torque_Nm()[joint] = raw.torque / scale.mille_per_Nm;
  state.motor_position_rad()[joint] = raw.motor_position * motor_rad;
  state.motor_velocity_rad_s()[joint] = raw.motor_velocity * motor_rad;
  state.current_A()[joint] = raw.current * kAmperePerUnit;
  state.voltage_V()[joint] = raw.voltage * kVoltPerUnit;
  state.temperature_C()[joint] = raw.temperature * kKelvinPerUnit;
  state.statusword()[joint] = raw.statusword;
  const auto drive = canopen::drive_state(raw.statusword);
  state.drive_state()[joint] = static_cast<std::uint8_t>(drive);
  auto [mode, interaction] = image_mode(raw.mode_display);
  if (drive != canopen::DriveMachineState::kOperationEnabled) mode = ControlMode::kIdle;
  state.mode()[joint] = static_cast<std::int8_t>(mode);
  state.interaction()[joint] = static_cast<std::uint8_t>(interaction);
}

void RawFeedback::archive(Archive& ar) {
  ar(position, velocity, motor_position, motor_velocity, statusword, error_code, torque, current,
     voltage, temperature, mode_display);
}

void RawCommand::archive(Archive& ar) {
  ar(target_position, velocity_offset, stiffness, damping, controlword, torque_offset,
     target_voltage, target_current, mode);
}

}  // namespace tandem::hal::can
