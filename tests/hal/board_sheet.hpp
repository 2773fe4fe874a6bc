// A robot.toml of one joint on a drive of another make, and its data sheet, for tests that change
// both.
#pragma once

#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <string>

#include "hal/config/robot_config.hpp"
#include "tests/support/scratch_folder.hpp"

namespace tandem::hal {

inline constexpr const char* kArm = R"(name = "arm"
[model]
urdf = "arm.urdf"
base = "fixed"
[actuator.motor]
order = 0
resistance_ohm = 1.0
torque_constant_Nm_A = 0.02
gear_ratio = 50
inertia_kg_m2 = 0.002
damping_Nms_rad = 0.17
current_limit_A = 10
voltage_limit_V = 24
[gains.motor]
position = { kp = 6.0 }
torque_feedforward = 1.0
[[bus]]
name = "arm"
fd = false
[[board]]
name = "drive"
bus = "arm"
eds = "drive.eds"
joints = ["elbow"]
[[joint]]
name = "elbow"
actuator = "motor"
min_position_rad = -1.5
max_position_rad = 1.5
max_velocity_rad_s = 3.0
max_torque_Nm = 10.0
)";

struct BoardSheet : ::testing::Test {
  BoardSheet() {
    std::ifstream file(std::string(TANDEM_SOURCE_DIR) + "/config/drives/servo.eds");
    sheet = {std::istreambuf_iterator<char>(file), {}};
    EXPECT_GT(sheet.size(), 10000U);
  }
  static std::string with(std::string text, const std::string& from, const std::string& to) {
    const std::size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    return text.replace(at, from.size(), to);
  }
  auto read(const std::string& robot = kArm) {
    std::ofstream(folder / "drive.eds") << sheet;
    return parse_robot_config(robot, folder / "robot.toml");
  }
  /// The only error's text.
  std::string refused(const std::string& robot = kArm) {
    const auto config = read(robot);
    if (config) return "taken";
    return config.error().size() == 1 ? config.error()[0].to_string() : "several errors";
  }

  /// Appends a variable of 32 bits to the sheet, or sub 1 and 2 of an array.
  void add(const std::string& index, const std::string& value) {
    sheet += "[" + index + "]\nParameterName=Added\nObjectType=0x7\nDataType=0x0007\n" +
             "AccessType=rw\nDefaultValue=" + value + "\n";
  }
  void add(const std::string& index, const std::string& first, const std::string& second) {
    sheet += "[" + index + "]\nParameterName=Added\nObjectType=0x8\nSubNumber=3\n";
    add(index + "sub0", "2");
    add(index + "sub1", first);
    add(index + "sub2", second);
  }

  tandem::test::ScratchFolder folder;
  std::string sheet;
};

inline constexpr const char* kLast = "max_torque_Nm = 10.0\n";

/// The arm with more of its joint, or of its board.
inline std::string joint_with(const std::string& lines) {
  std::string text = kArm;
  return text.replace(text.find(kLast), std::string(kLast).size(), kLast + lines);
}
inline std::string board_with(const std::string& lines) {
  const std::string last = "joints = [\"elbow\"]\n";
  std::string text = kArm;
  return text.replace(text.find(last), last.size(), last + lines);
}

}  // namespace tandem::hal
