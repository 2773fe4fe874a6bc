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

/// YARP's interfaces over a robot's images, once for every backend:
/// `devices.modes.set_control_mode(j, ControlMode::kPosition);
///  devices.position.position_move(j, 0.5);` and, each cycle, `devices.advance()`.
class Devices {
 public:
  /// The images outlive this. Gives every compliant joint its default impedance.
  Devices(const Robot& robot, const StateImage& state, CommandImage& command,
          ParameterImage& parameters, std::int64_t period_ns);
  Devices(const Devices&) = delete;
  Devices& operator=(const Devices&) = delete;

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
  Clock clock;
};

}  // namespace tandem::hal
