// The text of a robot.toml that the tests of reading it start from.
#pragma once

#include <gtest/gtest.h>

#include <string>

#include "hal/config/robot_config.hpp"

namespace tandem::hal {

/// A leg with everything that the tests change, and no error.
inline constexpr const char* kRobot = R"(name = "leg"
[model]
urdf = "leg.urdf"
base = "floating"
[model.lock]
toe = 0.1
[[site]]
name = "sole"
link = "foot"
xyz_m = [0, 0, -0.1]
wrench = true
[actuator.big]
resistance_ohm = 0.664
torque_constant_Nm_A = 0.041
gear_ratio = 100
inertia_kg_m2 = 0.1387
damping_Nms_rad = 25.5
spring_Nm_rad = 395.46
spring_damping_Nms_rad = 0.198
current_limit_A = 50
voltage_limit_V = 40
[gains.big]
position = {kp = 200, kd = 5, output_limit = 100}
torque = {kp = 0.3}
position_feedback = "motor"
emf_compensation = 0.9
[[bus]]
name = "left"
interface = "can0"
[[board]]
name = "hip_board"
bus = "left"
node_id = 3
[joint_defaults]
encoder_counts_per_rev = 65536
motor_encoder_counts_per_rev = 409600
[[joint]]
name = "hip"
board = "hip_board"
actuator = "big"
gains = "big"
min_position_rad = -1.5
max_position_rad = 1.0
[[joint]]
name = "knee"
board = "hip_board"
axis = 1
actuator = "big"
gains = "big"
on_fault = "hold"
max_torque_Nm = 80
[[sensor]]
name = "foot_ft"
type = "force_torque"
bus = "left"
node_id = 10
joint = "ankle"
link = "foot"
noise = [1, 1, 1, 0.1, 0.1, 0.1]
[contact]
stiffness_N_m = 5e4
damping_s_m = 10
tangential_stiffness_N_m = 1e4
tangential_damping_Ns_m = 10
static_friction = 0.9
sliding_friction = 0.8
[[contact.foot]]
site = "sole"
points_m = [[0.1, 0.05, 0], [-0.1, 0.05, 0], [0, -0.05, 0]]
[posture.home]
base_height_m = 0.5
knee = 0.2
)";

/// What the description of that leg says.
inline RobotDescription description() {
  RobotDescription d;
  d.moving_joints = {{"hip", -2.0, 2.0, 5.0, 100.0}, {"knee", 0.0, 2.0, 6.0, 200.0}};
  d.other_joints = {"toe", "ankle"};
  d.links = {"pelvis", "thigh", "shank", "foot"};
  return d;
}

/// The robot with `from` (which must occur once) replaced by `to`.
inline std::string with(const std::string& from, const std::string& to) {
  std::string text = kRobot;
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  EXPECT_EQ(text.find(from, at + 1), std::string::npos) << from << " occurs twice";
  return text.replace(at, from.size(), to);
}

/// Every error of a text, one a line.
inline std::string errors_of(const std::string& text) {
  const auto robot = parse_robot_config(text, "robots/leg.toml");
  std::string all;
  if (robot.has_value()) return all;
  for (const Error& error : robot.error()) all += error.to_string() + "\n";
  return all;
}

/// The text has this error and no other.
inline void expect_error(const std::string& text, const std::string& expected) {
  EXPECT_EQ(errors_of(text), expected + "\n");
}

/// `text` with `more` in front of the first `at`.
inline std::string with(std::string text, const std::string& at, const std::string& more) {
  return text.insert(text.find(at), more);
}

}  // namespace tandem::hal
