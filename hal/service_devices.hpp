// YARP's interfaces to what changes seldom: gains, impedance, amplifiers.
// Layer: hal.  Thread: the one that owns the images (the RT thread in the cycle).
#pragma once

#include "hal/joint_devices.hpp"

namespace tandem::hal {

// The rules at the top of joint_devices.hpp hold here too.

/// IPidControl: the gains of the firmware's loops; units as in GainsConfig.
class PidControl {
 public:
  explicit PidControl(JointAccess& access) : io_(access) {}
  /// Gains are not negative. They reach the drive by SDO, within some ten cycles.
  Code set_pid(std::size_t j, PidLoop loop, const PidGains& gains) noexcept TANDEM_RT;
  [[nodiscard]] PidGains pid(std::size_t j, PidLoop loop) const noexcept TANDEM_RT;
  /// Reference minus measurement of a loop [rad, rad/s, Nm or A].
  [[nodiscard]] double error(std::size_t j, PidLoop loop) const noexcept TANDEM_RT;

 private:
  JointAccess& io_;
};

/// A virtual spring and damper between the reference and the link.
struct Impedance {
  double stiffness_Nm_rad = 0.0;
  double damping_Nms_rad = 0.0;
};

/// IImpedanceControl: works in position and velocity control when compliant.
class ImpedanceControl {
 public:
  explicit ImpedanceControl(JointAccess& access) : io_(access) {}
  /// Both between 0 and impedance_limits(). @return kOutOfRange also for a joint that cannot yield.
  Code set_impedance(std::size_t j, const Impedance& impedance) noexcept TANDEM_RT;
  [[nodiscard]] Impedance impedance(std::size_t j) const noexcept TANDEM_RT;
  /// A torque added to the spring's and the damper's (gravity, say).
  Code set_impedance_offset(std::size_t j, double Nm) noexcept TANDEM_RT;
  [[nodiscard]] double impedance_offset_Nm(std::size_t j) const noexcept TANDEM_RT;
  /// The largest stiffness and damping of this joint.
  [[nodiscard]] Impedance impedance_limits(std::size_t j) const noexcept TANDEM_RT;

 private:
  JointAccess& io_;
};

/// IAmplifierControl: power, currents and faults.
class AmplifierControl {
 public:
  explicit AmplifierControl(JointAccess& access)
      : io_(access),
        enabled_mode_(access.joints.size(), ControlMode::kPosition),
        resets_(access.joints.size()) {}
  /// Enables the drive in the mode it had before disable() (position control at first), with its
  /// references at the measured state.
  Code enable(std::size_t j) noexcept TANDEM_RT;
  /// Takes the torque off: the joint is idle.
  Code disable(std::size_t j) noexcept TANDEM_RT;
  /// The CiA 402 state; kUnknown without such a joint.
  [[nodiscard]] DriveState status(std::size_t j) const noexcept TANDEM_RT;
  /// Measured motor current and winding temperature.
  [[nodiscard]] double current_A(std::size_t j) const noexcept TANDEM_RT;
  [[nodiscard]] double temperature_C(std::size_t j) const noexcept TANDEM_RT;
  [[nodiscard]] double max_current_A(std::size_t j) const noexcept TANDEM_RT;
  /// 0, or the drive's CiA 402 error code.
  [[nodiscard]] std::uint32_t fault(std::size_t j) const noexcept TANDEM_RT;
  /// Asks the drive to clear its latched fault, until it has; references are seeded anew.
  Code reset_fault(std::size_t j) noexcept TANDEM_RT;

  /// Withdraws those of its resets that have worked. Called once a cycle.
  void advance() noexcept TANDEM_RT;
  void archive(Archive& ar);

 private:
  JointAccess& io_;
  std::vector<ControlMode> enabled_mode_;
  std::vector<std::uint8_t> resets_;  // asked for here
};

}  // namespace tandem::hal
