// Builds every device interface over one pair of images, and finds sensors by name and type.
#include "hal/devices.hpp"

#include "base/archive.hpp"
#include "base/nearest.hpp"

namespace tandem::hal {

Devices::Devices(const Robot& robot, ParameterImage& gains, std::int64_t period_ns)
    : no_state_(robot.shape()),
      no_command_(robot.shape()),
      access_{
          &no_state_, &no_command_, &gains, {robot.joints.begin(), robot.joints.end()}, period_ns},
      sensors_(robot.sensors),
      encoders(access_),
      modes(access_),
      interaction(access_),
      position(access_),
      position_direct(access_),
      velocity(access_),
      torque(access_),
      open_loop(access_),
      current(access_),
      pid(access_),
      impedance(access_),
      amplifier(access_),
      clock(access_) {}

Devices::Devices(const Robot& robot, const StateImage& state, CommandImage& command,
                 ParameterImage& gains, std::int64_t period_ns)
    : Devices(robot, gains, period_ns) {
  begin(state, command);
  for (std::size_t j = 0; j < access_.joints.size(); ++j) {
    command.stiffness_Nm_rad()[j] = access_.joints[j].stiffness_Nm_rad;
    command.damping_Nms_rad()[j] = access_.joints[j].damping_Nms_rad;
  }
}

void Devices::begin(const StateImage& state, CommandImage& command) noexcept TANDEM_RT {
  access_.state = &state;
  access_.command = &command;
}

void Devices::advance() noexcept TANDEM_RT {
  amplifier.advance();
  position.advance();
  velocity.advance();
}

void Devices::archive(Archive& ar) { ar(position, velocity, amplifier); }

Result<std::size_t> Devices::sensor(std::string_view name, SensorType type) const {
  std::vector<std::string> names;
  for (std::size_t i = 0; i < sensors_.size(); ++i) {
    if (sensors_[i].type != type) continue;
    if (sensors_[i].name == name) return i;
    names.push_back(sensors_[i].name);
  }
  const char* kind = type == SensorType::kImu ? "IMU" : "force/torque sensor";
  return fail("the robot has no " + std::string(kind) + " '" + std::string(name) + "'",
              suggest(name, names));
}

Result<SixAxisForceTorque> Devices::force_torque(std::string_view name) const {
  const Result<std::size_t> index = sensor(name, SensorType::kForceTorque);
  if (!index) return std::unexpected(index.error());
  return SixAxisForceTorque(access_, *index);
}

Result<Imu> Devices::imu(std::string_view name) const {
  const Result<std::size_t> index = sensor(name, SensorType::kImu);
  if (!index) return std::unexpected(index.error());
  return Imu(access_, *index);
}

}  // namespace tandem::hal
