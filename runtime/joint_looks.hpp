// Joints and sensors as the loop shows them after each cycle.
// Layer: runtime.  Thread: plain data.
#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "hal/config/robot_config.hpp"
#include "hal/image.hpp"

namespace tandem::runtime {

/// A joint after the last cycle: plain words, as the loop shows them.
struct JointStatus {
  std::uint64_t cycle = 0;
  double position_rad = 0.0, velocity_rad_s = 0.0, torque_Nm = 0.0;  ///< measured
  double acceleration_rad_s2 = 0.0;
  double motor_position_rad = 0.0, motor_velocity_rad_s = 0.0;   ///< on the link side
  double current_A = 0.0, voltage_V = 0.0, temperature_C = 0.0;  ///< of the motor
  double commanded_rad = 0.0;  ///< NaN: outside position control nobody wrote a reference
  double stiffness_Nm_rad = 0.0, damping_Nms_rad = 0.0;  ///< asked for: the command goes over to it
  std::uint32_t fault = 0;                               ///< 0, or the drive's CiA 402 error code
  std::uint32_t age_cycles = 0;                          ///< of the sample
  std::int32_t owner = -1;       ///< slot of the active controller that claims it
  std::int8_t mode = 0;          ///< hal::ControlMode asked for
  std::uint8_t interaction = 0;  ///< hal::InteractionMode asked for
  std::int8_t drive_mode = 0;    ///< hal::ControlMode in force
  std::uint8_t drive_state = 0;  ///< hal::DriveState
  std::uint8_t moving = 0;       ///< by move_joint() or recover()
  std::uint8_t resetting = 0;    ///< by reset_joint()
  hal::Homing homing;            ///< what is known of its place
  std::uint8_t padding[4] = {};
};

/// The same with what is known of it besides.
struct JointInfo {
  std::string name;
  std::string owner;    ///< controller; empty: nobody
  bool slides = false;  ///< prismatic: m and N
  JointStatus look;
  std::array<hal::PidGains, hal::kPidLoops> gains{};  ///< by hal::PidLoop, as asked for last
};

/// A sensor after the last cycle.
struct SensorStatus {
  static constexpr std::size_t kMostChannels = 10;

  std::uint64_t cycle = 0;
  std::uint64_t age_cycles = 0;                ///< of the sample
  std::uint64_t valid = 0;                     ///< 1: there is a sample, and it is not too old
  std::array<double, kMostChannels> values{};  ///< of its channels, hal::channels_of() first ones
};

/// The same with what is known of it besides.
struct SensorReport {
  std::string name;
  hal::SensorType type = hal::SensorType::kForceTorque;
  std::string joint;  ///< force_torque: measures the wrench through this joint
  std::string link;   ///< the frame of its values
  SensorStatus look;
};

}  // namespace tandem::runtime
