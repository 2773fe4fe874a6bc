// YARP's joint interfaces over the process image: the same for every backend.
// Layer: hal.  Thread: the one that owns the images (the RT thread in the cycle).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/realtime.hpp"
#include "hal/image.hpp"
#include "hal/joint_capabilities.hpp"
#include "hal/trapezoid.hpp"

namespace tandem {
class Archive;
}

namespace tandem::hal {

/// What the interfaces work on: this cycle's images.
struct JointAccess {
  const StateImage* state;
  CommandImage* command;
  ParameterImage* parameters;
  std::vector<JointCapabilities> joints;
  std::int64_t period_ns;
};

// In every interface: `j` is the joint's index in the image. Values are on the link side, positive
// about the joint's +axis, unless a name says motor. A setter changes the command of this cycle;
// its effect is in the state some cycles later. It answers
//   kOk          done,
//   kNotFinite   a value is not finite,
//   kOutOfRange  there is no such joint, the value is beyond its limit, the joint cannot do it, or
//                it is not in the mode that the call needs;
// and changes nothing unless it answers kOk. A getter of a joint that does not exist gives NaN.

/// IEncodersTimed and IMotorEncoders. Zero is the drive's: encoders cannot be reset from here.
class Encoders {
 public:
  explicit Encoders(const JointAccess& access) : io_(access) {}
  [[nodiscard]] std::size_t axes() const noexcept { return io_.joints.size(); }
  [[nodiscard]] double position_rad(std::size_t j) const noexcept TANDEM_RT;
  [[nodiscard]] double velocity_rad_s(std::size_t j) const noexcept TANDEM_RT;
  [[nodiscard]] double acceleration_rad_s2(std::size_t j) const noexcept TANDEM_RT;
  /// Nominal time at which the sample was taken; -1 without such a joint.
  [[nodiscard]] std::int64_t timestamp_ns(std::size_t j) const noexcept TANDEM_RT;
  /// Motion of the motor, reflected to the link.
  [[nodiscard]] double motor_position_rad(std::size_t j) const noexcept TANDEM_RT;
  [[nodiscard]] double motor_velocity_rad_s(std::size_t j) const noexcept TANDEM_RT;

 private:
  const JointAccess& io_;
};

/// IControlMode2. Every joint can be idle; the other modes are the joint's capabilities.
class ControlModes {
 public:
  explicit ControlModes(JointAccess& access) : io_(access) {}
  /// Asks for a mode and seeds every reference from the measured state, so that nothing jumps.
  Code set_control_mode(std::size_t j, ControlMode mode) noexcept TANDEM_RT;
  /// The mode in force, as the drive says; kIdle without such a joint.
  [[nodiscard]] ControlMode control_mode(std::size_t j) const noexcept TANDEM_RT;

 private:
  JointAccess& io_;
};

/// IInteractionMode: whether position and velocity control are rigid or yield.
class InteractionModes {
 public:
  explicit InteractionModes(JointAccess& access) : io_(access) {}
  /// Seeds the references too. @return kOutOfRange also for a joint that cannot yield.
  Code set_interaction_mode(std::size_t j, InteractionMode mode) noexcept TANDEM_RT;
  /// The one in force, as the drive says; kStiff without such a joint.
  [[nodiscard]] InteractionMode interaction_mode(std::size_t j) const noexcept TANDEM_RT;

 private:
  JointAccess& io_;
};

/// IPositionControl: point-to-point motions with a trapezoidal speed. Mode kPosition.
class PositionControl {
 public:
  explicit PositionControl(JointAccess& access);
  /// Starts a motion to `target_rad`; one under way goes over into it without a jump. When it is
  /// too fast to rest there, it passes the target and comes back.
  Code position_move(std::size_t j, double target_rad) noexcept TANDEM_RT;
  /// The same, by `way_rad` from the reference's place now.
  Code relative_move(std::size_t j, double way_rad) noexcept TANDEM_RT;
  /// Whether the reference has arrived (or no motion was asked for).
  [[nodiscard]] bool check_motion_done(std::size_t j) const noexcept TANDEM_RT;
  [[nodiscard]] bool check_motion_done() const noexcept TANDEM_RT;
  /// Greater than 0 and at most the joint's limit. Default: a quarter of the limit.
  Code set_ref_speed(std::size_t j, double rad_s) noexcept TANDEM_RT;
  [[nodiscard]] double ref_speed_rad_s(std::size_t j) const noexcept TANDEM_RT;
  /// Greater than 0 and at most the joint's limit. Default: the default speed in half a second, or
  /// that limit. A motion under way keeps the largest that it had: with less it could not brake
  /// before its joint's limits.
  Code set_ref_acceleration(std::size_t j, double rad_s2) noexcept TANDEM_RT;
  [[nodiscard]] double ref_acceleration_rad_s2(std::size_t j) const noexcept TANDEM_RT;
  /// Brakes with the motion's acceleration, at least the default one, and stays there.
  Code stop(std::size_t j) noexcept TANDEM_RT;
  /// Ends every motion, or the joint's, without a further reference: somebody else has the joint.
  void abandon() noexcept TANDEM_RT;
  void abandon(std::size_t j) noexcept TANDEM_RT;
  /// Where the motion ends; the reference itself when there is none.
  [[nodiscard]] double target_position_rad(std::size_t j) const noexcept TANDEM_RT;

  /// Writes this cycle's references of the motions under way. Called once a cycle.
  void advance() noexcept TANDEM_RT;
  void archive(Archive& ar);

 private:
  enum Phase : std::int64_t { kResting, kMoving, kBraking };
  struct Motion {
    Trapezoid reference;
    double target_rad = 0.0;
    double speed_rad_s = 0.0;
    double acceleration_rad_s2 = 0.0;
    double hardest_rad_s2 = 0.0;  ///< the largest acceleration since it left its rest
    std::int64_t phase = kResting;
  };
  JointAccess& io_;
  std::vector<Motion> motions_;
};

/// IPositionDirect: the reference itself, streamed cycle by cycle. Mode kPosition.
class PositionDirect {
 public:
  explicit PositionDirect(JointAccess& access) : io_(access) {}
  Code set_position(std::size_t j, double rad) noexcept TANDEM_RT;
  [[nodiscard]] double ref_position_rad(std::size_t j) const noexcept TANDEM_RT;

 private:
  JointAccess& io_;
};

/// IVelocityControl. Mode kVelocity.
class VelocityControl {
 public:
  explicit VelocityControl(JointAccess& access);
  /// Brings the reference to `rad_s` with the reference acceleration.
  Code velocity_move(std::size_t j, double rad_s) noexcept TANDEM_RT;
  [[nodiscard]] double target_velocity_rad_s(std::size_t j) const noexcept TANDEM_RT;
  /// Greater than 0 and at most the joint's limit. Default: the joint's velocity limit in two
  /// seconds, or that limit.
  Code set_ref_acceleration(std::size_t j, double rad_s2) noexcept TANDEM_RT;
  [[nodiscard]] double ref_acceleration_rad_s2(std::size_t j) const noexcept TANDEM_RT;
  Code stop(std::size_t j) noexcept TANDEM_RT { return velocity_move(j, 0.0); }

  /// Writes this cycle's references of the joints that velocity_move() has moved in this mode.
  /// Called once a cycle.
  void advance() noexcept TANDEM_RT;
  void archive(Archive& ar);

 private:
  struct Ramp {
    double target_rad_s = 0.0;
    double acceleration_rad_s2 = 0.0;
    std::int64_t asked = 0;  ///< else the joint's reference is somebody else's
  };
  JointAccess& io_;
  std::vector<Ramp> ramps_;
};

/// ITorqueControl: of the spring on the link. Setting needs mode kTorque, measuring none.
class TorqueControl {
 public:
  explicit TorqueControl(JointAccess& access) : io_(access) {}
  [[nodiscard]] double torque_Nm(std::size_t j) const noexcept TANDEM_RT;
  Code set_ref_torque(std::size_t j, double Nm) noexcept TANDEM_RT;
  [[nodiscard]] double ref_torque_Nm(std::size_t j) const noexcept TANDEM_RT;
  /// References lie within plus and minus this.
  [[nodiscard]] double max_torque_Nm(std::size_t j) const noexcept TANDEM_RT;

 private:
  JointAccess& io_;
};

/// IOpenLoopControl, in volts instead of duty cycles. Mode kOpenLoop.
class OpenLoopControl {
 public:
  explicit OpenLoopControl(JointAccess& access) : io_(access) {}
  Code set_ref_voltage(std::size_t j, double V) noexcept TANDEM_RT;
  [[nodiscard]] double ref_voltage_V(std::size_t j) const noexcept TANDEM_RT;
  /// The voltage applied to the motor, in any mode.
  [[nodiscard]] double voltage_V(std::size_t j) const noexcept TANDEM_RT;

 private:
  JointAccess& io_;
};

/// ICurrentControl. Mode kCurrent.
class CurrentControl {
 public:
  explicit CurrentControl(JointAccess& access) : io_(access) {}
  Code set_ref_current(std::size_t j, double A) noexcept TANDEM_RT;
  [[nodiscard]] double ref_current_A(std::size_t j) const noexcept TANDEM_RT;

 private:
  JointAccess& io_;
};

}  // namespace tandem::hal
