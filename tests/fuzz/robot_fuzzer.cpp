// Whatever bytes stand for a robot.toml: errors with a message, or a robot whose references all
// lead somewhere.
#include <cmath>
#include <cstdint>
#include <string_view>

#include "hal/config/robot_config.hpp"
#include "tests/fuzz/require.hpp"

namespace {

using tandem::fuzz::require;

void check(tandem::hal::RobotConfig robot) {
  tandem::hal::RobotDescription description;
  for (const auto& joint : robot.joints) {
    require(robot.board(joint.board) != nullptr);
    require(robot.actuator_of(joint).resistance_ohm > 0.0);
    require(robot.gains_of(joint).position.gains.kp >= 0.0);
    description.moving_joints.push_back({joint.name, -1.0, 1.0, 1.0, 1.0});
  }
  for (const auto& board : robot.boards) require(robot.bus(board.bus) != nullptr);
  require(robot.shape().joints == robot.joints.size());
  if (!tandem::hal::complete_from_description(robot, description).empty()) return;
  for (const auto& joint : robot.joints) {
    require(joint.min_position_rad < joint.max_position_rad);
    require(joint.max_torque_Nm > 0.0 && std::isfinite(joint.rated_torque_Nm));
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const auto robot = tandem::hal::parse_robot_config(text, "fuzz/robot.toml");
  if (robot.has_value()) {
    check(*robot);
  } else {
    require(!robot.error().empty());
    for (const auto& error : robot.error()) require(!error.to_string().empty());
  }
  return 0;
}
