// Entries, types, limits and access of an axis' objects, and their conversion to the controller's
// SI units. docs/firmware.md has the table.
#include "firmware_emu/axis_objects.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "canopen/bytes.hpp"

namespace tandem::firmware {

namespace {

using namespace canopen;
namespace co = canopen::object;
namespace own = firmware::object;

constexpr ObjectRange kNotNegative{0.0, 3.0e38};
constexpr double kLongestBrake_ms = 10'000.0;

float real32(double value) { return static_cast<float>(value); }

std::array<float, 4> gains_of(const Pid::Config& pid) {
  return {real32(pid.kp), real32(pid.ki), real32(pid.kd), real32(pid.output_limit)};
}

Pid::Config pid_of(const std::array<float, 4>& gains) noexcept TANDEM_RT {
  return {.kp = gains[0], .ki = gains[1], .kd = gains[2], .output_limit = gains[3]};
}

/// Adds `values` as sub 1 to n, and their number as sub 0.
template <std::size_t n>
bool add_array(ObjectDictionary& od, std::uint16_t index, std::array<float, n>& values,
               std::uint8_t access, ObjectRange range = {}, ObjectOwner* owner = nullptr) {
  bool done = od.add_value<std::uint8_t>(index, 0, n);
  for (std::size_t i = 0; i < n; ++i) {
    done &= od.add(index, static_cast<std::uint8_t>(i + 1), values[i], access, range, owner);
  }
  return done;
}

}  // namespace

AxisObjects AxisObjects::from(const AxisSetup& setup, int command_timeout_syncs) {
  const ControllerConfig& c = setup.controller;
  const double counts_per_rad = setup.link_counts_per_rev / (2.0 * std::numbers::pi);
  AxisObjects o;
  o.min_position = clamp_round<std::int32_t>(c.min_position_rad * counts_per_rad);
  o.max_position = clamp_round<std::int32_t>(c.max_position_rad * counts_per_rad);
  o.following_window = clamp_round<std::uint32_t>(setup.following_window_rad * counts_per_rad);
  o.rated_torque_mNm = std::max(1U, clamp_round<std::uint32_t>(setup.rated_torque_Nm * 1.0e3));
  o.torque_slope =
      std::max(1U, clamp_round<std::uint32_t>(c.torque_slope_Nm_s * 1.0e3 / setup.rated_torque_Nm));
  o.quick_stop_deceleration =
      std::max(1U, clamp_round<std::uint32_t>(setup.quick_stop_rad_s2 * counts_per_rad));
  o.link_counts = clamp_round<std::uint32_t>(setup.link_counts_per_rev);
  o.motor_counts = clamp_round<std::uint32_t>(setup.motor_counts_per_rev);
  o.stiffness = real32(setup.stiffness_Nm_rad);
  o.damping = real32(setup.damping_Nms_rad);
  o.gains = {gains_of(c.position), gains_of(c.velocity), gains_of(c.torque), gains_of(c.current)};
  o.feed_forward = {real32(c.torque_to_voltage_V_Nm), real32(c.emf_compensation_Vs_rad)};
  o.motor_data = {real32(c.resistance_ohm), real32(c.motor_constant_Nm_A), real32(c.spring_Nm_rad)};
  o.cutoffs_Hz = {real32(setup.link_velocity_cutoff_Hz), real32(setup.motor_velocity_cutoff_Hz),
                  real32(setup.torque_rate_cutoff_Hz)};
  o.limits = {real32(c.voltage_limit_V), real32(c.current_limit_A), real32(c.torque_limit_Nm),
              real32(c.velocity_limit_rad_s)};
  o.i2t = {real32(setup.continuous_current_A), real32(setup.thermal_time_s)};
  o.mismatch = {real32(setup.mismatch_window_rad), real32(setup.mismatch_timeout_s)};
  o.oscillation = {real32(setup.oscillation_limit_Nm), real32(setup.oscillation_time_s)};
  o.excess = {real32(setup.excess_share), real32(setup.excess_time_s)};
  o.swing = real32(setup.swing_limit_rad_s);
  o.transfer_time_s = real32(c.transfer_time_s);
  o.undervoltage_V = real32(setup.undervoltage_V);
  o.stop_time_s = real32(setup.stop_time_s);
  o.position_margin_rad = real32(setup.position_margin_rad);
  o.following_timeout_ms = clamp_round<std::uint16_t>(setup.following_timeout_s * 1.0e3);
  o.brake = {static_cast<std::uint16_t>(setup.brake ? 1 : 0), setup.brake_release_ms,
             setup.brake_engage_ms};
  o.max_torque = std::numeric_limits<std::uint16_t>::max();
  o.command_timeout = clamp_round<std::uint16_t>(command_timeout_syncs);
  o.temperature_limit = clamp_round<std::int16_t>(setup.temperature_limit_C * 10.0);
  o.position_feedback = static_cast<std::uint8_t>(c.position_feedback);
  return o;
}

double AxisObjects::rad_per_count() const noexcept TANDEM_RT {
  return 2.0 * std::numbers::pi / link_counts;
}

ControllerConfig AxisObjects::controller() const noexcept TANDEM_RT {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  const bool below = min_position == std::numeric_limits<std::int32_t>::min();
  const bool above = max_position == std::numeric_limits<std::int32_t>::max();
  const double torque_limit_Nm = limits[kTorqueLimit - 1];
  const double slope_Nm_s = torque_slope * 1.0e-3 * rated_torque_Nm();
  return {.position = pid_of(gains[0]),
          .velocity = pid_of(gains[1]),
          .torque = pid_of(gains[2]),
          .current = pid_of(gains[3]),
          .torque_to_voltage_V_Nm = feed_forward[kTorqueToVoltage - 1],
          .emf_compensation_Vs_rad = feed_forward[kEmfCompensation - 1],
          .resistance_ohm = motor_data[kMotorResistance - 1],
          .motor_constant_Nm_A = motor_data[kMotorTorqueConstant - 1],
          .spring_Nm_rad = motor_data[kMotorSpring - 1],
          .voltage_limit_V = limits[kVoltageLimit - 1],
          .current_limit_A = limits[kCurrentLimit - 1],
          .torque_limit_Nm = std::min(torque_limit_Nm, max_torque * 1.0e-3 * rated_torque_Nm()),
          .torque_slope_Nm_s = torque_slope == kNoTorqueSlope ? kInfinity : slope_Nm_s,
          .velocity_limit_rad_s = limits[kVelocityLimit - 1],
          .min_position_rad = below ? -kInfinity : min_position * rad_per_count(),
          .max_position_rad = above ? kInfinity : max_position * rad_per_count(),
          .stop_deceleration_rad_s2 = quick_stop_deceleration * rad_per_count(),
          .transfer_time_s = transfer_time_s,
          .position_feedback = static_cast<PositionFeedback>(position_feedback)};
}

bool AxisObjects::add_to(ObjectDictionary& od, int axis, ObjectOwner& owner) {
  return add_profile(od, axis, owner) && add_limits(od, axis, owner) && add_actual(od, axis) &&
         add_demands(od, axis, owner) && add_settings(od, axis, owner);
}

bool AxisObjects::add_profile(ObjectDictionary& od, int axis, ObjectOwner& owner) {
  const auto at = [axis](std::uint16_t index) { return of_axis(index, axis); };
  return od.add(at(co::kAbortConnectionOption), 0, abort_option, kReadWrite, {0, 3}) &&
         od.add(at(co::kErrorCode), 0, error_code, kReadTpdo) &&
         od.add(at(co::kControlword), 0, controlword, kWriteRpdo) &&
         od.add(at(co::kStatusword), 0, statusword, kReadTpdo) &&
         od.add(at(co::kQuickStopOption), 0, options.quick_stop, kReadWrite, {-1, 6}, &owner) &&
         od.add(at(co::kShutdownOption), 0, options.shutdown, kReadWrite, {0, 1}) &&
         od.add(at(co::kDisableOption), 0, options.disable_operation, kReadWrite, {0, 1}) &&
         od.add(at(co::kHaltOption), 0, options.halt, kReadWrite, {1, 2}) &&
         od.add(at(co::kFaultReactionOption), 0, options.fault_reaction, kReadWrite, {-1, 2}) &&
         od.add_value<std::uint8_t>(at(co::kInterpolationPeriod), 0, 2) &&
         od.add(at(co::kInterpolationPeriod), 1, interpolation_units, kReadWrite, {1, 255}) &&
         od.add(at(co::kInterpolationPeriod), 2, interpolation_power, kReadWrite, {-128, 63}) &&
         od.add(at(co::kMode), 0, mode, kWriteRpdo, {-4, 10}, &owner) &&
         od.add(at(co::kModeDisplay), 0, mode_display, kReadTpdo) &&
         od.add_value(at(co::kSupportedModes), 0, kTandemModes);
}

bool AxisObjects::add_limits(ObjectDictionary& od, int axis, ObjectOwner& owner) {
  const auto at = [axis](std::uint16_t index) { return of_axis(index, axis); };
  return od.add(at(co::kFollowingErrorWindow), 0, following_window, kReadWrite, {}, &owner) &&
         od.add(at(co::kFollowingErrorTimeout), 0, following_timeout_ms, kReadWrite, {}, &owner) &&
         od.add(at(co::kMaxTorque), 0, max_torque, kReadWrite, {}, &owner) &&
         od.add(at(co::kRatedTorque), 0, rated_torque_mNm, kReadWrite, {1, 4294967295.0}, &owner) &&
         od.add(at(co::kQuickStopDeceleration), 0, quick_stop_deceleration, kReadWrite,
                {1, 4294967295.0}, &owner) &&
         od.add(at(co::kTorqueSlope), 0, torque_slope, kReadWrite, {1, 4294967295.0}, &owner) &&
         od.add_value<std::uint8_t>(at(co::kSoftwareLimits), 0, 2) &&
         od.add(at(co::kSoftwareLimits), 1, min_position, kReadWrite, {}, &owner) &&
         od.add(at(co::kSoftwareLimits), 2, max_position, kReadWrite, {}, &owner) &&
         od.add_value<std::uint8_t>(at(co::kEncoderResolution), 0, 2) &&
         od.add(at(co::kEncoderResolution), 1, link_counts, kReadWrite, {1, 4294967295.0},
                &owner) &&
         od.add_value<std::uint32_t>(at(co::kEncoderResolution), 2, 1) &&
         od.add(at(co::kMotorResolution), 0, motor_counts, kReadWrite, {1, 4294967295.0}, &owner) &&
         add_array(od, at(co::kLimits), limits, kReadWrite, kNotNegative, &owner) &&
         add_array(od, at(co::kI2t), i2t, kReadWrite, kNotNegative, &owner) &&
         add_array(od, at(own::kMismatch), mismatch, kReadWrite, kNotNegative, &owner) &&
         add_array(od, at(co::kOscillation), oscillation, kReadWrite, kNotNegative, &owner) &&
         add_array(od, at(co::kExcess), excess, kReadWrite, kNotNegative, &owner) &&
         od.add(at(co::kSwing), 0, swing, kReadWrite, kNotNegative, &owner) &&
         od.add_value<std::uint8_t>(at(co::kBrake), 0, 3) &&
         od.add(at(co::kBrake), kBrakeFitted, brake[0], kReadWrite, {0, 1}, &owner) &&
         od.add(at(co::kBrake), kBrakeRelease, brake[1], kReadWrite, {0, kLongestBrake_ms},
                &owner) &&
         od.add(at(co::kBrake), kBrakeEngage, brake[2], kReadWrite, {0, kLongestBrake_ms},
                &owner) &&
         od.add(at(co::kCommandTimeout), 0, command_timeout, kReadWrite) &&
         od.add(at(co::kTemperatureLimit), 0, temperature_limit, kReadWrite, {}, &owner) &&
         od.add(at(own::kUndervoltage), 0, undervoltage_V, kReadWrite, kNotNegative, &owner) &&
         od.add(at(own::kStopTime), 0, stop_time_s, kReadWrite, kNotNegative, &owner) &&
         od.add(at(own::kPositionMargin), 0, position_margin_rad, kReadWrite, kNotNegative, &owner);
}

bool AxisObjects::add_actual(ObjectDictionary& od, int axis) {
  const auto at = [axis](std::uint16_t index) { return of_axis(index, axis); };
  return od.add(at(co::kPosition), 0, position, kReadTpdo) &&
         od.add(at(co::kVelocity), 0, velocity, kReadTpdo) &&
         od.add(at(co::kTorque), 0, torque, kReadTpdo) &&
         od.add(at(co::kFollowingError), 0, following_error, kReadTpdo) &&
         od.add(at(co::kDigitalInputs), 0, digital_inputs, kReadTpdo) &&
         od.add_value<std::uint8_t>(at(co::kDigitalOutputs), 0, 1) &&
         od.add(at(co::kDigitalOutputs), 1, digital_outputs, kReadTpdo) &&
         od.add(at(co::kMotorPosition), 0, motor_position, kReadTpdo) &&
         od.add(at(co::kMotorVelocity), 0, motor_velocity, kReadTpdo) &&
         od.add(at(co::kCurrent), 0, current, kReadTpdo) &&
         od.add(at(co::kVoltage), 0, voltage, kReadTpdo) &&
         od.add(at(co::kTemperature), 0, temperature, kReadTpdo) &&
         add_array(od, at(own::kTelemetry), telemetry, kReadTpdo) &&
         od.add(at(own::kRefusedValues), 0, refused_values, kReadTpdo);
}

bool AxisObjects::add_demands(ObjectDictionary& od, int axis, ObjectOwner& owner) {
  const auto at = [axis](std::uint16_t index) { return of_axis(index, axis); };
  return od.add(at(co::kTargetPosition), 0, target_position, kWriteRpdo) &&
         od.add(at(co::kTargetVelocity), 0, target_velocity, kWriteRpdo) &&
         od.add(at(co::kVelocityOffset), 0, velocity_offset, kWriteRpdo) &&
         od.add(at(co::kTargetTorque), 0, target_torque, kWriteRpdo) &&
         od.add(at(co::kTorqueOffset), 0, torque_offset, kWriteRpdo) &&
         od.add(at(co::kTargetVoltage), 0, target_voltage, kWriteRpdo) &&
         od.add(at(co::kTargetCurrent), 0, target_current, kWriteRpdo) &&
         od.add(at(co::kStiffness), 0, stiffness, kWriteRpdo, kNotNegative, &owner) &&
         od.add(at(co::kDamping), 0, damping, kWriteRpdo, kNotNegative, &owner);
}

bool AxisObjects::add_settings(ObjectDictionary& od, int axis, ObjectOwner& owner) {
  const auto at = [axis](std::uint16_t index) { return of_axis(index, axis); };
  return add_array(od, at(co::kPositionGains), gains[0], kReadWrite, kNotNegative, &owner) &&
         add_array(od, at(co::kVelocityGains), gains[1], kReadWrite, kNotNegative, &owner) &&
         add_array(od, at(co::kTorqueGains), gains[2], kReadWrite, kNotNegative, &owner) &&
         add_array(od, at(co::kCurrentGains), gains[3], kReadWrite, kNotNegative, &owner) &&
         add_array(od, at(co::kFeedForward), feed_forward, kReadWrite, kNotNegative, &owner) &&
         add_array(od, at(co::kMotorData), motor_data, kReadWrite, kNotNegative, &owner) &&
         add_array(od, at(own::kEstimators), cutoffs_Hz, kReadWrite, kNotNegative, &owner) &&
         od.add(at(co::kPositionFeedback), 0, position_feedback, kReadWrite, {0, 1}, &owner) &&
         od.add(at(own::kTransferTime), 0, transfer_time_s, kReadWrite, kNotNegative, &owner);
}

}  // namespace tandem::firmware
