// A robot of one joint around the hand-written pendulum: a board, an IMU at its tip, a force/torque
// sensor in its joint, one bus.
#pragma once

#include <string>

#include "hal/config/robot_config.hpp"
#include "hal/sim/sim_robot.hpp"
#include "tests/sim/hand_kernels.hpp"

namespace tandem::test {

inline hal::RobotConfig swing_robot(int order = 2,
                                    const std::string& control_period = "1_000_000") {
  // A rigid drive's torque follows its voltage at once: a proportional loop would be algebraic.
  const std::string torque = order < 2 ? "kp = 0.0, ki = 5.0" : "kp = 0.4, ki = 2.0, kd = 0.008";
  const std::string text = R"(
name = "swing"
[model]
urdf = "swing.urdf"
base = "fixed"
[actuator.motor]
order = )" + std::to_string(order) +
                           R"(
resistance_ohm = 0.664
inductance_H = 0.32e-3
torque_constant_Nm_A = 0.041
gear_ratio = 100
inertia_kg_m2 = 0.139
damping_Nms_rad = 25.5
spring_Nm_rad = 1000.0
spring_damping_Nms_rad = 1.0
current_limit_A = 50
voltage_limit_V = 40
[gains.motor]
position_feedback = "motor"
position = { kp = 600.0, ki = 300.0, kd = 25.5 }
velocity = { kp = 20.0, ki = 60.0 }
torque = { )" + torque + R"( }
current = { kp = 0.5, ki = 200.0 }
torque_feedforward = 1.0
emf_compensation = 0.9
stiffness_Nm_rad = 100.0
damping_Nms_rad = 10.0
[[bus]]
name = "line"
interface = "can0"
fd = true
bitrate = 1_000_000
data_bitrate = 8_000_000
[[board]]
name = "board"
bus = "line"
node_id = 1
control_period_ns = )" + control_period +
                           R"(
[[joint]]
name = "swing"
board = "board"
axis = 0
actuator = "motor"
gains = "motor"
rated_torque_Nm = 50.0
min_position_rad = -3.0
max_position_rad = 3.0
max_velocity_rad_s = 5.0
max_torque_Nm = 50.0
encoder_counts_per_rev = 262144
motor_encoder_counts_per_rev = 819200
torque_noise_Nm = 0.01
[[sensor]]
name = "tip"
type = "imu"
bus = "line"
node_id = 20
link = "mass"
noise = [0, 0, 0, 0, 0.001, 0.001, 0.001, 0.01, 0.01, 0.01]
[[sensor]]
name = "root"
type = "force_torque"
bus = "line"
node_id = 21
joint = "swing"
link = "mass"
[posture.up]
swing = 0.5
)";
  auto robot = hal::parse_robot_config(text, "swing.toml");
  if (!robot) {
    for (const Error& error : robot.error()) std::fputs((error.to_string() + "\n").c_str(), stderr);
    std::abort();
  }
  return *robot;
}

/// The same on classic CAN: a bus for the board, one for the force/torque sensor. The IMU has more
/// channels than a classic node can send, so its bus is CAN FD.
inline hal::RobotConfig classic_swing_robot() {
  hal::RobotConfig robot = swing_robot(2);
  robot.buses[0].fd = false;
  robot.buses.push_back({.name = "root", .interface = "can1", .fd = false});
  robot.buses.push_back({.name = "tip", .interface = "can2"});
  robot.sensors[0].bus = "tip";
  robot.sensors[1].bus = "root";
  return robot;
}

/// The same on EtherCAT: board and sensors in one line.
inline hal::RobotConfig line_swing_robot(const std::string& control_period = "1_000_000") {
  hal::RobotConfig robot = swing_robot(2, control_period);
  robot.buses[0].kind = hal::BusKind::kEthercat;
  robot.sensors[0].node_id = 2;
  robot.sensors[1].node_id = 3;
  return robot;
}

inline const tandem_kernels* swing_kernels(int order) {
  return order < 2 ? pendulum_kernels<139>() : pendulum_kernels<0>();
}

}  // namespace tandem::test
