// Defaults, boards below their bus and joints below their board.
#include <gtest/gtest.h>

#include "tests/hal/robot_config_text.hpp"

namespace tandem::hal {
namespace {

// The same leg, said once: defaults, boards below their bus, joints below their board.
const char* const kShort = R"(name = "leg"
[model]
urdf = "leg.urdf"
base = "floating"
[actuator_defaults]
resistance_ohm = 0.664
torque_constant_Nm_A = 0.041
gear_ratio = 100
inertia_kg_m2 = 0.1387
damping_Nms_rad = 25.5
current_limit_A = 50
voltage_limit_V = 40
[actuator.big]
spring_Nm_rad = 395.46
[actuator.stiff]
spring_Nm_rad = 8400
gear_ratio = 80
[gains_defaults]
position = {kp = 200, kd = 5}
emf_compensation = 0.9
[gains.big]
[gains.stiff]
position = {kp = 300}
[bus_defaults]
bitrate = 500_000
[board_defaults]
slow_pdo_every = 4
[[bus]]
name = "left"
boards = [
  { name = "hip_board", joints = ["hip", "knee"] },
  { name = "foot_board", joints = ["ankle"], slow_pdo_every = 2 },
]
[[board]]
name = "toe_board"
bus = "left"
[joint_defaults]
encoder_counts_per_rev = 65536
motor_encoder_counts_per_rev = 409600
actuator = "big"
[[joint]]
name = "toe"
board = "toe_board"
gains = "stiff"
[[joint]]
names = ["ankle", "hip"]
max_torque_Nm = 80
[[joint]]
name = "knee"
actuator = "stiff"
encoder_counts_per_rev = 1000
[[sensor]]
name = "imu"
type = "imu"
bus = "left"
link = "pelvis"
heartbeat_ms = 80
)";

std::string shortened(const std::string& from, const std::string& to) {
  std::string text = kShort;
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

TEST(RobotConfigDefaults, StandForWhatATableDoesNotSay) {
  const auto robot = parse_robot_config(kShort, "robots/leg.toml");
  ASSERT_TRUE(robot.has_value()) << errors_of(kShort);
  ASSERT_EQ(robot->actuators.size(), 2u);
  EXPECT_EQ(robot->actuators[0].gear_ratio, 100.0);
  EXPECT_EQ(robot->actuators[1].gear_ratio, 80.0);
  EXPECT_EQ(robot->actuators[1].voltage_limit_V, 40.0);
  EXPECT_EQ(robot->gains[0].position.gains.kd, 5.0);
  EXPECT_EQ(robot->gains[1].position.gains.kp, 300.0);
  EXPECT_EQ(robot->gains[1].position.gains.kd, 0.0) << "a loop is taken over whole or not at all";
  EXPECT_EQ(robot->gains[1].emf_compensation, 0.9);
  EXPECT_EQ(robot->buses[0].bitrate, 500'000);
  EXPECT_EQ(robot->boards[0].slow_pdo_every, 4);
  EXPECT_EQ(robot->boards[1].slow_pdo_every, 2);
  EXPECT_EQ(robot->boards[1].heartbeat_ms, 50);
  EXPECT_EQ(robot->sensors[0].heartbeat_ms, 80);
}

TEST(RobotConfigDefaults, OrderJointsByTheBoardsThatListThemThenByTheFile) {
  const auto robot = parse_robot_config(kShort, "robots/leg.toml");
  ASSERT_TRUE(robot.has_value()) << errors_of(kShort);
  ASSERT_EQ(robot->joints.size(), 4u);
  const std::vector<std::string> names{"hip", "knee", "ankle", "toe"};
  const std::vector<std::string> boards{"hip_board", "hip_board", "foot_board", "toe_board"};
  const std::vector<int> axes{0, 1, 0, 0};
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(robot->joints[i].name, names[i]);
    EXPECT_EQ(robot->joints[i].board, boards[i]);
    EXPECT_EQ(robot->joints[i].axis, axes[i]);
  }
  EXPECT_EQ(robot->joints[0].max_torque_Nm, 80.0);
  EXPECT_EQ(robot->joints[2].max_torque_Nm, 80.0);
  EXPECT_EQ(robot->joints[0].gains, "big") << "of the actuator's name";
  EXPECT_EQ(robot->joints[1].gains, "stiff");
  EXPECT_EQ(robot->joints[1].encoder_counts_per_rev, 1000.0);
  EXPECT_EQ(robot->joints[3].gains, "stiff");
  EXPECT_EQ(robot->joints[3].actuator, "big");
}

TEST(RobotConfigDefaults, CountNodeIdsUpOnEachBus) {
  std::string text = shortened("joints = [\"ankle\"]", "joints = [\"ankle\"], node_id = 7");
  text +=
      "[[bus]]\nname = 'other'\n"
      "[[sensor]]\nname = 'imu2'\ntype = 'imu'\nbus = 'other'\nlink = 'foot'\n";
  const auto robot = parse_robot_config(text, "robots/leg.toml");
  ASSERT_TRUE(robot.has_value()) << errors_of(text);
  EXPECT_EQ(robot->boards[0].node_id, 1);
  EXPECT_EQ(robot->boards[1].node_id, 7);
  EXPECT_EQ(robot->boards[2].node_id, 8);
  EXPECT_EQ(robot->sensors[0].node_id, 9);
  EXPECT_EQ(robot->sensors[1].node_id, 1);
}

TEST(RobotConfigDefaults, HaveNoNodeIdAfterTheLast) {
  expect_error(
      shortened("joints = [\"ankle\"]", "joints = [\"ankle\"], node_id = 126"),
      "robots/leg.toml:34: board.toe_board.node_id: no node id is left after 126 on bus 'left' "
      "(set node_id, here or of the node before)\n"
      "robots/leg.toml:52: sensor.imu.node_id: no node id is left after 126 on bus 'left' "
      "(set node_id, here or of the node before)");
}

TEST(RobotConfigDefaults, AreCheckedOnceWhoeverUsesThem) {
  expect_error(shortened("damping_Nms_rad = 25.5", "damping_Nms_rad = -1"),
               "robots/leg.toml:10: actuator_defaults.damping_Nms_rad: -1 is out of range "
               "(must be at least 0)");
  expect_error(shortened("actuator = \"big\"", "actuator = \"bigg\"\ngains = \"stiff\""),
               "robots/leg.toml:40: joint_defaults.actuator: there is no actuator 'bigg' "
               "(did you mean 'big'?)");
  expect_error(shortened("position = {kp = 200, kd = 5}", "position = {kp = 200, kd = -5}"),
               "robots/leg.toml:19: gains_defaults.position.kd: this gain has the wrong sign "
               "(gains are not negative: they act on reference minus measurement)");
  expect_error(shortened("gear_ratio = 100\n", "gear_ration = 100\n"),
               "robots/leg.toml:8: actuator_defaults.gear_ration: unknown key "
               "(did you mean 'gear_ratio'?)");
  expect_error(shortened("gear_ratio = 100\n", ""),
               "robots/leg.toml:12: actuator.big.gear_ratio: this key is missing "
               "(add it to the table, or to [actuator_defaults] for all)");
}

TEST(RobotConfigDefaults, ReportAListThatCannotBeReadOnce) {
  expect_error(
      shortened("joints = [\"ankle\"]", "joints = \"ankle\""),
      "robots/leg.toml:32: bus.left.boards.foot_board.joints: must be a list of texts, not string");
  expect_error(shortened("names = [\"ankle\", \"hip\"]", "names = 3"),
               "robots/leg.toml:46: joint[1].names: must be a list of texts, not integer");
  expect_error(shortened("actuator = \"big\"\n", "actuator = \"bigger\"\n"),
               "robots/leg.toml:40: joint_defaults.actuator: there is no actuator 'bigger' "
               "(did you mean 'big'?)");
}

TEST(RobotConfigDefaults, LetSensorsStandBelowTheirBus) {
  const std::string table =
      "[[sensor]]\nname = \"imu\"\ntype = \"imu\"\nbus = \"left\"\n"
      "link = \"pelvis\"\n";
  std::string text = shortened(table,
                               "[[sensor]]\nname = \"imu2\"\ntype = \"imu\"\n"
                               "bus = \"left\"\nlink = \"foot\"\n");
  const std::string end = "slow_pdo_every = 2 },\n]\n";
  text.insert(text.find(end) + end.size(),
              "sensors = [{ name = \"imu\", type = \"imu\", link = \"pelvis\" }]\n");
  const auto robot = parse_robot_config(text, "robots/leg.toml");
  ASSERT_TRUE(robot.has_value()) << errors_of(text);
  ASSERT_EQ(robot->sensors.size(), 2u);
  const auto apart = parse_robot_config(kShort, "robots/leg.toml");
  ASSERT_TRUE(apart.has_value());
  const SensorConfig& inside = robot->sensors[0];
  const SensorConfig& outside = apart->sensors[0];
  EXPECT_EQ(inside.name, outside.name);
  EXPECT_EQ(inside.type, outside.type);
  EXPECT_EQ(inside.bus, outside.bus);
  EXPECT_EQ(inside.node_id, outside.node_id) << "after the boards, those of [[board]] too";
  EXPECT_EQ(inside.link, outside.link);
  EXPECT_EQ(robot->sensors[1].name, "imu2");
  EXPECT_EQ(robot->sensors[1].node_id, inside.node_id + 1);
  const std::string key = "sensors = [{";
  text.insert(text.find(key) + key.size(), " bus = \"left\",");
  expect_error(
      text,
      "robots/leg.toml:34: bus.left.sensors.imu.bus: this stands in the table of bus 'left' "
      "already (remove this key)");
}

TEST(RobotConfigDefaults, AreCheckedWhenNobodyUsesThem) {
  expect_error(
      "name = 'm'\n[model]\nurdf = 'm.urdf'\nbase = 'fixed'\n"
      "[bus_defaults]\nmax_load = 7\nname = 'x'\n",
      "robots/leg.toml:6: bus_defaults.max_load: 7 is out of range "
      "(must be at least 0.01 and at most 1)\n"
      "robots/leg.toml:7: bus_defaults.name: unknown key (known: bitrate, data_bitrate, fd, kind, "
      "max_load)");
}

TEST(RobotConfigDefaults, RefuseAJointThatNoTableDescribes) {
  expect_error(
      shortened("\"hip\", \"knee\"]", "\"hip\", \"knee\", \"kneee\"]"),
      "robots/leg.toml:31: bus.left.boards.hip_board.joints: there is no [[joint]] 'kneee' "
      "(did you mean 'knee'?)");
}

TEST(RobotConfigDefaults, RefuseAJointThatNoBoardHas) {
  expect_error(shortened("[\"ankle\", \"hip\"]", "[\"ankle\", \"hip\", \"heel\"]"),
               "robots/leg.toml:46: joint[1].names: no board lists joint 'heel' "
               "(add it to the joints of its board)");
  expect_error(shortened("board = \"toe_board\"\n", ""),
               "robots/leg.toml:35: board.toe_board.name: no joint is on board 'toe_board' "
               "(list its joints, or remove the board)\n"
               "robots/leg.toml:41: joint.toe.board: this key is missing "
               "(add it to the table, or the joint to the joints of its board)");
}

TEST(RobotConfigDefaults, RefuseAJointThatTwoBoardsListOrOneTwice) {
  expect_error(
      shortened("[\"ankle\"]", "[\"ankle\", \"hip\"]"),
      "robots/leg.toml:32: bus.left.boards.foot_board.joints: the joint 'hip' is on two boards, "
      "'hip_board' and 'foot_board' (remove one of the two)");
  expect_error(
      shortened("[\"ankle\"]", "[\"ankle\", \"ankle\"]"),
      "robots/leg.toml:32: bus.left.boards.foot_board.joints: the joint 'ankle' is listed twice "
      "(remove one of the two)");
}

TEST(RobotConfigDefaults, RefuseABoardForAJointThatIsListed) {
  expect_error(shortened("name = \"knee\"\n", "name = \"knee\"\nboard = \"toe_board\"\n"),
               "robots/leg.toml:50: joint.knee.board: board 'hip_board' lists joint 'knee' already "
               "(remove this key)");
}

TEST(RobotConfigDefaults, RefuseAnActuatorWhoseGainsAreMissing) {
  expect_error(
      shortened("[gains.stiff]\nposition = {kp = 300}\n", "[gains.stif]\n"),
      "robots/leg.toml:43: joint.toe.gains: there is no gains table 'stiff' "
      "(did you mean 'stif'?)\n"
      "robots/leg.toml:47: joint.knee.gains: there is no [gains.stiff] for the actuator of "
      "that name (add that table, or set gains)");
}

TEST(RobotConfigDefaults, AskForANameOrNames) {
  expect_error(
      shortened("name = \"knee\"\n", "name = \"knee\"\nnames = [\"knee\"]\n"),
      "robots/leg.toml:50: joint.knee.names: a joint's table has a name or names, not both "
      "(remove one of the two)");
}

}  // namespace
}  // namespace tandem::hal
