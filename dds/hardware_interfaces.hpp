// What of the images ros2_control calls an interface of its hardware: names as it has them where it
// does, in tables.
// Layer: dds.  Thread: any, non-RT.
#pragma once

#include <array>
#include <span>

#include "hal/config/capabilities.hpp"
#include "hal/image.hpp"
#include "hal/robot.hpp"

namespace tandem::dds {

/// A value of each joint that is measured.
struct StateInterface {
  const char* name;
  std::span<const double> (hal::StateImage::*values)() const noexcept;
  bool hal::MotorFeedback::*told = nullptr;  ///< null: of every joint
};
inline constexpr std::array<StateInterface, 9> kStateInterfaces{{
    {"position", &hal::StateImage::position_rad},
    {"velocity", &hal::StateImage::velocity_rad_s},
    {"acceleration", &hal::StateImage::acceleration_rad_s2},
    {"effort", &hal::StateImage::torque_Nm, &hal::MotorFeedback::torque},
    {"motor_position", &hal::StateImage::motor_position_rad},
    {"motor_velocity", &hal::StateImage::motor_velocity_rad_s},
    {"current", &hal::StateImage::current_A, &hal::MotorFeedback::current},
    {"voltage", &hal::StateImage::voltage_V, &hal::MotorFeedback::voltage},
    {"temperature", &hal::StateImage::temperature_C, &hal::MotorFeedback::temperature},
}};

/// A value of each joint that is commanded.
struct CommandInterface {
  const char* name;
  std::span<const double> (hal::CommandImage::*values)() const noexcept;
};
inline constexpr std::array<CommandInterface, 7> kCommandInterfaces{{
    {"position", &hal::CommandImage::position_rad},
    {"velocity", &hal::CommandImage::velocity_rad_s},
    {"effort", &hal::CommandImage::torque_Nm},
    {"voltage", &hal::CommandImage::voltage_V},
    {"current", &hal::CommandImage::current_A},
    {"stiffness", &hal::CommandImage::stiffness_Nm_rad},
    {"damping", &hal::CommandImage::damping_Nms_rad},
}};

/// The channels of a sensor, in the image's order.
inline constexpr std::array<const char*, hal::channels_of(hal::SensorType::kForceTorque)>
    kForceTorqueInterfaces{"force.x", "force.y", "force.z", "torque.x", "torque.y", "torque.z"};
inline constexpr std::array<const char*, hal::channels_of(hal::SensorType::kImu)> kImuInterfaces{
    "orientation.x",         "orientation.y",         "orientation.z",      "orientation.w",
    "angular_velocity.x",    "angular_velocity.y",    "angular_velocity.z", "linear_acceleration.x",
    "linear_acceleration.y", "linear_acceleration.z",
};
[[nodiscard]] constexpr std::span<const char* const> sensor_interfaces(hal::SensorType type) {
  if (type == hal::SensorType::kImu) return kImuInterfaces;
  return kForceTorqueInterfaces;
}

}  // namespace tandem::dds
