// What a joint can do and how far: plain data.
// Layer: hal.  Thread: non-RT to make; immutable afterwards.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <string>

#include "base/realtime.hpp"
#include "hal/image.hpp"

namespace tandem::hal {

/// One thing that a joint may be able to do. Bits of JointCapabilities::bits. Of a drive of another
/// maker its data sheet decides, not the gains table: its loops are its own.
enum class Capability : std::uint8_t {
  kPosition = 1 << 0,   ///< its gains table has a position loop and a torque loop under it
  kVelocity = 1 << 1,   ///< its gains table has a velocity loop and a torque loop under it
  kTorque = 1 << 2,     ///< its gains table turns a torque into a voltage, and it has a limit
  kCompliant = 1 << 3,  ///< as kTorque: the virtual spring and damper act through it
  kOpenLoop = 1 << 4,   ///< its actuator takes a voltage
  kCurrent = 1 << 5,    ///< its gains table has a current loop, and its actuator a current limit
};
[[nodiscard]] const char* to_string(Capability capability) noexcept;

/// In which torque, velocity, current, voltage, stiffness or damping may go from nothing to its
/// limit where the joint declares no rate: faster than a drive's mechanics, slower than an error in
/// a program.
inline constexpr double kFullScale_s = 0.01;

/// Share of a joint's largest velocity: one that is measured to move slower than that rests.
inline constexpr double kRestShare = 0.01;

/// A joint's limits, link side, and its capabilities. Torque and
/// impedance limits of a joint that cannot do torque control are 0.
struct JointCapabilities {
  double min_position_rad = 0.0;
  double max_position_rad = 0.0;
  double max_velocity_rad_s = 0.0;
  double max_acceleration_rad_s2 = std::numeric_limits<double>::infinity();  ///< of references
  double max_jerk_rad_s3 = std::numeric_limits<double>::infinity();
  double max_torque_Nm = 0.0;
  /// Rate of the torque reference, as declared; else its limit in kFullScale_s.
  double max_torque_rate_Nm_s = 0.0;
  double max_voltage_V = 0.0;
  double max_current_A = 0.0;  ///< the actuator's, or what gives max_torque_Nm where that is less
  /// Rates of references: their limit in kFullScale_s; no faster than max_torque_rate_Nm_s gives.
  double max_voltage_rate_V_s = std::numeric_limits<double>::infinity();
  double max_current_rate_A_s = std::numeric_limits<double>::infinity();
  /// Limit of the virtual spring: the position loop's kp (softer than stiff control), or the
  /// configured default where that is larger.
  double max_stiffness_Nm_rad = 0.0;
  /// Limit of the virtual damper: critical for the motor's inertia at max_stiffness, or the
  /// position loop's kd or the configured default where they are larger.
  double max_damping_Nms_rad = 0.0;
  double stiffness_Nm_rad = 0.0;  ///< the gains table's default, when compliant
  double damping_Nms_rad = 0.0;
  std::uint8_t bits = 0;
  bool slides = false;  ///< prismatic: in every name read m for rad and N for Nm
  /// Largest gains of each loop, by PidLoop, in robot.toml and while it runs. Of an input at its
  /// full range (1 rad, 1 rad/s, the torque limit, the current limit) a loop's kp asks for 10^4,
  /// 100, 100 and 100 times the full output (torque limit or voltage limit): what is beyond is a
  /// slip of digits or units. 0: no such loop.
  std::array<PidGains, kPidLoops> most_gains{};

  [[nodiscard]] bool can(Capability capability) const noexcept TANDEM_RT {
    return (bits & static_cast<std::uint8_t>(capability)) != 0;
  }
  /// Whether the joint can be put into `mode`. Every joint can be idle.
  [[nodiscard]] bool can(ControlMode mode, InteractionMode interaction) const noexcept TANDEM_RT;
};

/// "" or what is wrong with gains of `loop`: "kp = 1e+30 is beyond …, all that … can use".
[[nodiscard]] std::string gains_problem(const JointCapabilities& joint, PidLoop loop,
                                        const PidGains& gains);

}  // namespace tandem::hal
