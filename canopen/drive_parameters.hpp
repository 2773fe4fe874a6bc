// What a joint's drive is set to: one table for both ends of the wire. A row is an object: what it
// is in the dictionary, in which unit it travels, and which parameter it carries.
// Layer: canopen.  Thread: any.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "base/realtime.hpp"
#include "canopen/object_dictionary.hpp"
#include "canopen/objects.hpp"

namespace tandem::canopen {

/// Units: output per error, per error and second, per error rate, output.
struct LoopGains {
  double kp = 0.0;
  double ki = 0.0;
  double kd = 0.0;
  double output_limit = 0.0;  ///< of output and integral, both signs; 0: none
};

/// In SI units. Link side; the motor reflected to the link. The values are our firmware's own.
struct DriveParameters {
  double link_counts_per_rev = 524288.0;
  double motor_counts_per_rev = 819200.0;  ///< per revolution of the link
  double rated_torque_Nm = 1.0;
  double max_torque_Nm = std::numeric_limits<double>::infinity();  ///< beside torque_limit_Nm
  /// By how much the torque reference may change: the limit of its rate.
  double torque_slope_Nm_s = std::numeric_limits<double>::infinity();
  double min_position_rad = -std::numeric_limits<double>::infinity();  ///< of references
  double max_position_rad = std::numeric_limits<double>::infinity();
  LoopGains position{};                  ///< [Nm/rad, Nm/(rad s), Nms/rad, Nm]
  LoopGains velocity{};                  ///< [Nms/rad, Nm/rad, Nms^2/rad, Nm]
  LoopGains torque{};                    ///< [V/Nm, V/(Nm s), Vs/Nm, V]
  LoopGains current{};                   ///< [V/A, V/(A s), Vs/A, V]
  double torque_to_voltage_V_Nm = 0.0;   ///< feed-forward, times the torque reference
  double emf_compensation_Vs_rad = 0.0;  ///< times the motor velocity
  /// Which encoder the stiff position loop's proportional and derivative terms act on. 0, the
  /// link's: e = q_ref - q. 1, the motor's: e = q_ref + tau_ff / Ks - theta, collocated; the
  /// integral stays on the link.
  double motor_feedback = 0.0;
  double resistance_ohm = 0.0;       ///< 0: unknown, the current is not limited by it
  double motor_constant_Nm_A = 0.0;  ///< N K: also the back-EMF [Vs/rad]
  double spring_Nm_rad = 0.0;        ///< Ks; 0: rigid
  double stiffness_Nm_rad = 0.0;     ///< of the impedance modes, until a command says another
  double damping_Nms_rad = 0.0;
  double voltage_limit_V = 0.0;
  double current_limit_A = 0.0;
  double torque_limit_Nm = 0.0;
  double velocity_limit_rad_s = 0.0;  ///< of velocity references and of the motion; 0: none
  double continuous_current_A = 0.0;  ///< 0: not watched
  double thermal_time_s = 30.0;
  double temperature_limit_C = 120.0;
  double following_window_rad = 0.5;  ///< 0: not watched
  double following_timeout_s = 0.1;
  double oscillation_limit_Nm = 0.0;  ///< 0: not watched
  double oscillation_time_s = 1.0;
  double excess_share = 0.0;  ///< by which motion may be beyond its limits; 0: not watched
  double excess_time_s = 0.1;
  double swing_limit_rad_s = 0.0;  ///< 0: not watched
  double brake_fitted = 0.0;       ///< 1: the motor has a spring-applied brake
  double brake_release_ms = 0.0;
  double brake_engage_ms = 0.0;
  double command_timeout_syncs = 10.0;      ///< 0: never
  double link_velocity_cutoff_Hz = 150.0;   ///< 0: plain difference
  double motor_velocity_cutoff_Hz = 150.0;  ///< 0: plain difference
  double torque_rate_cutoff_Hz = 150.0;     ///< 0: plain difference
  double transfer_time_s = 0.02;            ///< in which the voltage step of a mode change decays
  double undervoltage_V = 0.0;              ///< 0: not watched
  double stop_time_s = 1.0;                 ///< longest stop until the bridge opens
  double position_margin_rad = 0.1;         ///< beyond the position limits, until a fault
  double mismatch_window_rad = 0.0;         ///< 0: not watched
  double mismatch_timeout_s = 0.01;
  double stop_deceleration_rad_s2 = 20.0;  ///< of the quick stop's ramp

  /// Every parameter is NaN: nobody says anything about it.
  [[nodiscard]] static DriveParameters unsaid() noexcept;
  /// Takes every parameter of `other` that is not NaN.
  void take(const DriveParameters& other) noexcept;
};

/// The unit on the wire.
enum class WireUnit : std::uint8_t {
  kPlain,       ///< the parameter's own
  kCounts,      ///< counts of the link's encoder; 32 bit at their end: no limit
  kMille,       ///< per mille of the rated torque; the same
  kThousandth,  ///< milli
  kTenth,
};

/// A row: an object of axis 0 (see of_axis()) and its parameter.
struct DriveObject {
  std::uint16_t index;
  std::uint8_t sub;
  DataType type;
  WireUnit unit;
  std::uint8_t parameter;  ///< its place in DriveParameters, counted in doubles
  ObjectRange range = {};
  std::uint8_t access = kReadWrite;

  [[nodiscard]] double& of(DriveParameters& parameters) const noexcept TANDEM_RT {
    return reinterpret_cast<double*>(&parameters)[parameter];
  }
  [[nodiscard]] double of(const DriveParameters& parameters) const noexcept TANDEM_RT {
    return reinterpret_cast<const double*>(&parameters)[parameter];
  }
  [[nodiscard]] std::uint16_t size() const noexcept TANDEM_RT { return size_of(type); }
  /// The parameter on the wire: size() bytes, clamped and rounded to the nearest.
  [[nodiscard]] std::array<std::uint8_t, 4> encode(
      const DriveParameters& parameters) const noexcept TANDEM_RT;
  /// The way back. @pre the encoder's counts and the rated torque, the rows before, are decoded
  void decode(const std::uint8_t* bytes, DriveParameters& parameters) const noexcept TANDEM_RT;
};

namespace detail {
#define AT(member) static_cast<std::uint8_t>(offsetof(DriveParameters, member) / sizeof(double))
using enum DataType;
using enum WireUnit;
using namespace object;
inline constexpr ObjectRange kNotNegative{0.0, 3.0e38};
inline constexpr ObjectRange kAtLeastOne{1.0, 4294967295.0};
inline constexpr ObjectRange kYesOrNo{0.0, 1.0};
inline constexpr ObjectRange kBrakeTime_ms{0.0, 10'000.0};
}  // namespace detail

/// In the order in which a master writes them.
inline constexpr auto kDriveObjects = [] {
  using namespace detail;
  // clang-format off
  return std::to_array<DriveObject>({
    {kEncoderResolution, 1, kUnsigned32, kPlain, AT(link_counts_per_rev), kAtLeastOne},
    {kMotorResolution, 0, kUnsigned32, kPlain, AT(motor_counts_per_rev), kAtLeastOne},
    {kRatedTorque, 0, kUnsigned32, kThousandth, AT(rated_torque_Nm), kAtLeastOne},
    {kMaxTorque, 0, kUnsigned16, kMille, AT(max_torque_Nm)},
    {kTorqueSlope, 0, kUnsigned32, kMille, AT(torque_slope_Nm_s), kAtLeastOne},
    {kSoftwareLimits, 1, kInteger32, kCounts, AT(min_position_rad)},
    {kSoftwareLimits, 2, kInteger32, kCounts, AT(max_position_rad)},
    {kPositionGains, kPidKp, kReal32, kPlain, AT(position.kp), kNotNegative},
    {kPositionGains, kPidKi, kReal32, kPlain, AT(position.ki), kNotNegative},
    {kPositionGains, kPidKd, kReal32, kPlain, AT(position.kd), kNotNegative},
    {kPositionGains, kPidOutputLimit, kReal32, kPlain, AT(position.output_limit), kNotNegative},
    {kVelocityGains, kPidKp, kReal32, kPlain, AT(velocity.kp), kNotNegative},
    {kVelocityGains, kPidKi, kReal32, kPlain, AT(velocity.ki), kNotNegative},
    {kVelocityGains, kPidKd, kReal32, kPlain, AT(velocity.kd), kNotNegative},
    {kVelocityGains, kPidOutputLimit, kReal32, kPlain, AT(velocity.output_limit), kNotNegative},
    {kTorqueGains, kPidKp, kReal32, kPlain, AT(torque.kp), kNotNegative},
    {kTorqueGains, kPidKi, kReal32, kPlain, AT(torque.ki), kNotNegative},
    {kTorqueGains, kPidKd, kReal32, kPlain, AT(torque.kd), kNotNegative},
    {kTorqueGains, kPidOutputLimit, kReal32, kPlain, AT(torque.output_limit), kNotNegative},
    {kCurrentGains, kPidKp, kReal32, kPlain, AT(current.kp), kNotNegative},
    {kCurrentGains, kPidKi, kReal32, kPlain, AT(current.ki), kNotNegative},
    {kCurrentGains, kPidKd, kReal32, kPlain, AT(current.kd), kNotNegative},
    {kCurrentGains, kPidOutputLimit, kReal32, kPlain, AT(current.output_limit), kNotNegative},
    {kFeedForward, kTorqueToVoltage, kReal32, kPlain, AT(torque_to_voltage_V_Nm), kNotNegative},
    {kFeedForward, kEmfCompensation, kReal32, kPlain, AT(emf_compensation_Vs_rad), kNotNegative},
    {kPositionFeedback, 0, kUnsigned8, kPlain, AT(motor_feedback), kYesOrNo},
    {kMotorData, kMotorResistance, kReal32, kPlain, AT(resistance_ohm), kNotNegative},
    {kMotorData, kMotorTorqueConstant, kReal32, kPlain, AT(motor_constant_Nm_A), kNotNegative},
    {kMotorData, kMotorSpring, kReal32, kPlain, AT(spring_Nm_rad), kNotNegative},
    {kStiffness, 0, kReal32, kPlain, AT(stiffness_Nm_rad), kNotNegative, kWriteRpdo},
    {kDamping, 0, kReal32, kPlain, AT(damping_Nms_rad), kNotNegative, kWriteRpdo},
    {kLimits, kVoltageLimit, kReal32, kPlain, AT(voltage_limit_V), kNotNegative},
    {kLimits, kCurrentLimit, kReal32, kPlain, AT(current_limit_A), kNotNegative},
    {kLimits, kTorqueLimit, kReal32, kPlain, AT(torque_limit_Nm), kNotNegative},
    {kLimits, kVelocityLimit, kReal32, kPlain, AT(velocity_limit_rad_s), kNotNegative},
    {kI2t, kContinuousCurrent, kReal32, kPlain, AT(continuous_current_A), kNotNegative},
    {kI2t, kThermalTime, kReal32, kPlain, AT(thermal_time_s), kNotNegative},
    {kTemperatureLimit, 0, kInteger16, kTenth, AT(temperature_limit_C)},
    {kFollowingErrorWindow, 0, kUnsigned32, kCounts, AT(following_window_rad)},
    {kFollowingErrorTimeout, 0, kUnsigned16, kThousandth, AT(following_timeout_s)},
    {kOscillation, kOscillationLimit, kReal32, kPlain, AT(oscillation_limit_Nm), kNotNegative},
    {kOscillation, kOscillationTime, kReal32, kPlain, AT(oscillation_time_s), kNotNegative},
    {kExcess, kExcessShare, kReal32, kPlain, AT(excess_share), kNotNegative},
    {kExcess, kExcessTime, kReal32, kPlain, AT(excess_time_s), kNotNegative},
    {kSwing, 0, kReal32, kPlain, AT(swing_limit_rad_s), kNotNegative},
    {kBrake, kBrakeFitted, kUnsigned16, kPlain, AT(brake_fitted), kYesOrNo},
    {kBrake, kBrakeRelease, kUnsigned16, kPlain, AT(brake_release_ms), kBrakeTime_ms},
    {kBrake, kBrakeEngage, kUnsigned16, kPlain, AT(brake_engage_ms), kBrakeTime_ms},
    {kCommandTimeout, 0, kUnsigned16, kPlain, AT(command_timeout_syncs)},
    {kEstimators, 1, kReal32, kPlain, AT(link_velocity_cutoff_Hz), kNotNegative},
    {kEstimators, 2, kReal32, kPlain, AT(motor_velocity_cutoff_Hz), kNotNegative},
    {kEstimators, 3, kReal32, kPlain, AT(torque_rate_cutoff_Hz), kNotNegative},
    {kTransferTime, 0, kReal32, kPlain, AT(transfer_time_s), kNotNegative},
    {kUndervoltage, 0, kReal32, kPlain, AT(undervoltage_V), kNotNegative},
    {kStopTime, 0, kReal32, kPlain, AT(stop_time_s), kNotNegative},
    {kPositionMargin, 0, kReal32, kPlain, AT(position_margin_rad), kNotNegative},
    {kMismatch, 1, kReal32, kPlain, AT(mismatch_window_rad), kNotNegative},
    {kMismatch, 2, kReal32, kPlain, AT(mismatch_timeout_s), kNotNegative},
    {kQuickStopDeceleration, 0, kUnsigned32, kCounts, AT(stop_deceleration_rad_s2), kAtLeastOne},
  });
  // clang-format on
}();
#undef AT
static_assert(kDriveObjects.size() == sizeof(DriveParameters) / sizeof(double),
              "every parameter has its object");

/// The row of an object. @pre there is one
[[nodiscard]] consteval std::size_t drive_row(std::uint16_t index, std::uint8_t sub) {
  std::size_t row = 0;
  while (kDriveObjects[row].index != index || kDriveObjects[row].sub != sub) ++row;
  return row;
}

}  // namespace tandem::canopen
