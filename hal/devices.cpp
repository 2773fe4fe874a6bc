// Builds every device interface over one pair of images, and finds sensors by name and type.
#include "hal/devices.hpp"

#include "base/archive.hpp"
#include "base/nearest.hpp"

namespace tandem::hal {

Devices::Devices(const Robot& robot, const StateImage& state, CommandImage& command,
                 ParameterImage& parameters, std::int64_t period_ns)
    : access_{state, command, parameters, {robot.joints.begin(), robot.joints.end()}, period_ns},
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
      clock(state) {
  for (std::size_t j = 0; j < access_.joints.size(); ++j) {
    command.stiffness_Nm_rad()[j] = access_.joints[j].stiffness_Nm_rad;
    command.damping_Nms_rad()[j] = access_.joints[j].damping_Nms_rad;
  }
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
  return SixAxisForceTorque(access_.state, *index, access_.period_ns);
}

Result<Imu> Devices::imu(std::string_view name) const {
  const Result<std::size_t> index = sensor(name, SensorType::kImu);
  if (!index) return std::unexpected(index.error());
  return Imu(access_.state, *index, access_.period_ns);
}

}  // namespace tandem::hal
