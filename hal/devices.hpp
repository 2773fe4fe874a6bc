// All device interfaces of a robot in one place. Start here to command joints by hand.
// Layer: hal.  Thread: the one that owns the images (the RT thread in the cycle).
#pragma once

#include <string_view>
#include <vector>

#include "base/result.hpp"
#include "hal/joint_devices.hpp"
#include "hal/robot.hpp"
#include "hal/sensor_devices.hpp"
#include "hal/service_devices.hpp"

namespace tandem::hal {

/// YARP's interfaces over a robot's images, once for every backend. In each cycle:
///
///   devices.begin(state, command);              // the images of this cycle
///   devices.position.position_move(j, 0.5);     // whatever is to be done
///   devices.advance();                          // the references of the motions under way
///
/// A controller makes one in its configure() and begins it in each start() and update(); its claims
/// are the modes it may set (example 06). Before the first begin() the images are empty ones.
class Devices {
 public:
  /// @param gains  of the drives' loops, as they are asked for: ControllerSetup::gains. Outlives
  ///               this.
  Devices(const Robot& robot, ParameterImage& gains, std::int64_t period_ns);
  /// Takes images that stay, and outlive this. Gives every compliant joint its default impedance.
  Devices(const Robot& robot, const StateImage& state, CommandImage& command, ParameterImage& gains,
          std::int64_t period_ns);
  Devices(const Devices&) = delete;
  Devices& operator=(const Devices&) = delete;

  /// The images of this cycle; they stay until the next begin().
  void begin(const StateImage& state, CommandImage& command) noexcept TANDEM_RT;
  /// Writes this cycle's references of the motions under way: after read, before the limits.
  void advance() noexcept TANDEM_RT;
  void archive(Archive& ar);

  /// What joint `j` can do, and how far.
  [[nodiscard]] const JointCapabilities& capabilities(std::size_t j) const {
    return access_.joints.at(j);
  }
  /// A sensor by its name. Errors: no such sensor (with the nearest), or of the other type.
  [[nodiscard]] Result<SixAxisForceTorque> force_torque(std::string_view name) const;
  [[nodiscard]] Result<Imu> imu(std::string_view name) const;

 private:
  StateImage no_state_;
  CommandImage no_command_;
  JointAccess access_;
  std::vector<Sensor> sensors_;
  [[nodiscard]] Result<std::size_t> sensor(std::string_view name, SensorType type) const;

 public:
  Encoders encoders;
  ControlModes modes;
  InteractionModes interaction;
  PositionControl position;
  PositionDirect position_direct;
  VelocityControl velocity;
  TorqueControl torque;
  OpenLoopControl open_loop;
  CurrentControl current;
  PidControl pid;
  ImpedanceControl impedance;
  AmplifierControl amplifier;
  RobotClock clock;
};

}  // namespace tandem::hal
