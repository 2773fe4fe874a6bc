#include "hal/robot_config.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace tandem::hal {
namespace {

const char* const kRobot = R"(name = "leg"
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

RobotDescription description() {
  RobotDescription d;
  d.moving_joints = {{"hip", -2.0, 2.0, 5.0, 100.0}, {"knee", 0.0, 2.0, 6.0, 200.0}};
  d.other_joints = {"toe", "ankle"};
  d.links = {"pelvis", "thigh", "shank", "foot"};
  return d;
}

/// The robot with `from` (which must occur once) replaced by `to`.
std::string with(const std::string& from, const std::string& to) {
  std::string text = kRobot;
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  EXPECT_EQ(text.find(from, at + 1), std::string::npos) << from << " occurs twice";
  return text.replace(at, from.size(), to);
}

/// Every error of a text, one a line.
std::string errors_of(const std::string& text) {
  const auto robot = parse_robot_config(text, "robots/leg.toml");
  std::string all;
  if (robot.has_value()) return all;
  for (const Error& error : robot.error()) all += error.to_string() + "\n";
  return all;
}

void expect_error(const std::string& text, const std::string& expected) {
  EXPECT_EQ(errors_of(text), expected + "\n");
}

TEST(RobotConfig, IsReadWithItsDefaults) {
  const auto robot = parse_robot_config(kRobot, "robots/leg.toml");
  ASSERT_TRUE(robot.has_value()) << errors_of(kRobot);
  EXPECT_EQ(robot->name, "leg");
  EXPECT_EQ(robot->model.urdf, "robots/leg.urdf");
  EXPECT_TRUE(robot->model.floating_base);
  EXPECT_FALSE(robot->model.mimic_independent);
  ASSERT_EQ(robot->model.lock.size(), 1u);
  EXPECT_EQ(robot->model.lock[0], (std::pair<std::string, double>("toe", 0.1)));
  EXPECT_EQ(robot->model.gravity_m_s2[2], -9.81);
  ASSERT_EQ(robot->model.sites.size(), 1u);
  EXPECT_TRUE(robot->model.sites[0].wrench);
  EXPECT_EQ(robot->model.sites[0].xyz_m[2], -0.1);
  ASSERT_EQ(robot->joints.size(), 2u);
  EXPECT_EQ(robot->joint_index("knee"), 1);
  EXPECT_EQ(robot->joint_index("nose"), -1);
  const JointConfig& hip = robot->joints[0];
  EXPECT_EQ(hip.min_position_rad, -1.5);
  EXPECT_TRUE(std::isnan(hip.max_torque_Nm));
  EXPECT_EQ(hip.encoder_counts_per_rev, 65536);
  EXPECT_EQ(hip.on_fault, StopCategory::kCategory1);
  EXPECT_EQ(robot->joints[1].on_fault, StopCategory::kHold);
  EXPECT_EQ(robot->actuator_of(hip).order, 2);
  EXPECT_EQ(robot->actuator_of(hip).spring_Nm_rad, 395.46);
  EXPECT_EQ(robot->gains_of(hip).position.gains.kp, 200.0);
  EXPECT_EQ(robot->gains_of(hip).position.output_limit, 100.0);
  EXPECT_EQ(robot->gains_of(hip).position_feedback, PositionFeedback::kMotor);
  EXPECT_EQ(robot->gains_of(hip).torque_feedforward, 1.0);
  EXPECT_EQ(robot->board("hip_board")->control_period_ns, 1'000'000);
  EXPECT_EQ(robot->bus("left")->data_bitrate, 8'000'000);
  EXPECT_EQ(robot->shape().sensor_channels, std::vector<std::size_t>{6});
  EXPECT_EQ(robot->contact.feet[0].points_m[2][1], -0.05);
  EXPECT_EQ(robot->posture("home")->position_rad, (std::vector<double>{0.0, 0.2}));
  EXPECT_EQ(robot->posture("away"), nullptr);
}

std::string with(std::string text, const std::string& at, const std::string& more) {
  return text.insert(text.find(at), more);
}

TEST(RobotConfig, ReadsTheIdentityOfABoardAndProtections) {
  std::string text = with(kRobot, "[joint_defaults]", "product_code = 0x77\nserial = 5\n");
  text = with(text, "[gains.big]", "continuous_current_A = 12\nthermal_time_s = 60\n");
  text = with(text, "[[sensor]]", "following_error_rad = 0.2\nfollowing_timeout_s = 0.5\n");
  text = with(text, "[[joint]]", "following_error_rad = 0.3\n");
  text = with(text, "[[board]]", "max_load = 0.8\n");
  const auto robot = parse_robot_config(text, "leg.toml");
  ASSERT_TRUE(robot.has_value()) << robot.error()[0].to_string();
  EXPECT_EQ(robot->boards[0].product_code, 0x77u);
  EXPECT_EQ(robot->boards[0].serial, 5u);
  EXPECT_FALSE(robot->boards[0].vendor_id.has_value());
  EXPECT_FALSE(robot->boards[0].revision.has_value());
  EXPECT_EQ(robot->actuators[0].continuous_current_A, 12.0);
  EXPECT_EQ(robot->actuators[0].thermal_time_s, 60.0);
  EXPECT_EQ(robot->actuators[0].temperature_limit_C, 120.0);
  EXPECT_EQ(robot->joints[0].following_error_rad, 0.3) << "the default's";
  EXPECT_EQ(robot->joints[1].following_error_rad, 0.2);
  EXPECT_EQ(robot->joints[1].following_timeout_s, 0.5);
  EXPECT_EQ(robot->buses[0].max_load, 0.8);
}

TEST(RobotConfig, RefusesANameThatIsNoFileName) {
  expect_error(with("name = \"leg\"", "name = \"../../leg\""),
               "robots/leg.toml:1: name: '../../leg' has other characters than letters, digits, "
               "_, - and ., but it becomes part of file names "
               "(use letters, digits, _, - and ., at most 64)");
  EXPECT_NE(errors_of(with("name = \"leg\"", "name = \".leg\"")).find("begins with ."),
            std::string::npos);
}

TEST(RobotConfig, ReadsWhatALinkWeighsInsteadOfTheDescription) {
  const auto robot = parse_robot_config(
      with("[model.lock]",
           "inertia = 'repair'\n[model.link.foot]\nmass_kg = 2\ncom_m = [0, 0.1, 0.2]\n"
           "inertia_kg_m2 = [1, 2, 3, 4, 5, 6]\n[model.link.thigh]\nmass_kg = 0\n[model.lock]"),
      "leg.toml");
  ASSERT_TRUE(robot.has_value());
  EXPECT_TRUE(robot->model.repair_inertia);
  ASSERT_EQ(robot->model.links.size(), 2u);
  const LinkConfig& foot = robot->model.links[0];
  EXPECT_EQ(foot.name, "foot");
  EXPECT_EQ(foot.line, 6);
  EXPECT_EQ(foot.mass_kg, 2.0);
  EXPECT_EQ((*foot.com_m)[1], 0.1);
  EXPECT_EQ((*foot.inertia_kg_m2)[5], 6.0);
  EXPECT_EQ(robot->model.links[1].mass_kg, 0.0);
  EXPECT_FALSE(robot->model.links[1].inertia_kg_m2.has_value());
}

TEST(RobotConfig, RefusesALinkThatWeighsWrong) {
  const auto link = [](const std::string& keys) {
    return with("[model.lock]", "[model.link.foot]\n" + keys + "\n[model.lock]");
  };
  expect_error(link("mass_kg = -1"),
               "robots/leg.toml:6: model.link.foot.mass_kg: -1 is out of range "
               "(must be at least 0)");
  expect_error(link("mas_kg = 1\nmass_kg = 1"),
               "robots/leg.toml:6: model.link.foot.mas_kg: unknown key (did you mean 'mass_kg'?)");
  expect_error(link("inertia_kg_m2 = [1, 1, 1]"),
               "robots/leg.toml:6: model.link.foot.inertia_kg_m2: has 3 numbers (give exactly 6)");
  expect_error(link(""),
               "robots/leg.toml:5: model.link.foot: gives nothing "
               "(give mass_kg, com_m or inertia_kg_m2, or remove it)");
}

TEST(RobotConfig, RefusesAnActuatorWithoutInertia) {
  for (const std::string order : {"0", "1", "2"}) {
    EXPECT_NE(errors_of(with("inertia_kg_m2 = 0.1387", "inertia_kg_m2 = 0\norder = " + order))
                  .find("robots/leg.toml:16: actuator.big.inertia_kg_m2: 0 is out of range "
                        "(must be greater than 0)"),
              std::string::npos)
        << order;
  }
}

TEST(RobotConfig, OfABareModelNeedsNoJoints) {
  EXPECT_EQ(errors_of("name = 'm'\n[model]\nurdf = 'm.urdf'\nbase = 'fixed'\n"), "");
}

TEST(RobotConfig, NamesAMissingFile) {
  const auto robot = read_robot_config("/nonexistent/robot.toml");
  ASSERT_FALSE(robot.has_value());
  ASSERT_EQ(robot.error().size(), 1u);
  EXPECT_EQ(robot.error()[0].file, "/nonexistent/robot.toml");
}

TEST(RobotConfig, NamesTheLineOfBrokenToml) {
  const auto robot = parse_robot_config("name = 'leg'\n[model\n", "leg.toml");
  ASSERT_FALSE(robot.has_value());
  EXPECT_EQ(robot.error()[0].line, 2);
}

TEST(RobotConfig, SuggestsTheNearestForAMisspeltKey) {
  expect_error(with("gear_ratio = 100", "gear_ratio = 100\nvoltage_limt_V = 3"),
               "robots/leg.toml:16: actuator.big.voltage_limt_V: unknown key "
               "(did you mean 'voltage_limit_V'?)");
}

TEST(RobotConfig, RefusesGainsOfTheWrongSign) {
  expect_error(with("kp = 0.3", "kp = -0.3"),
               "robots/leg.toml:24: gains.big.torque.kp: this gain has the wrong sign "
               "(gains are not negative: they act on reference minus measurement)");
}

TEST(RobotConfig, RefusesAZeroResistance) {
  expect_error(with("resistance_ohm = 0.664", "resistance_ohm = 0"),
               "robots/leg.toml:13: actuator.big.resistance_ohm: 0 is out of range "
               "(must be greater than 0)");
}

TEST(RobotConfig, RefusesAnElectricalMotorWhoseDampingLacksItsBackEmf) {
  const std::string text =
      with("resistance_ohm = 0.664", "order = 3\ninductance_H = 3e-4\nresistance_ohm = 0.064");
  EXPECT_NE(errors_of(text).find("must include the back-EMF's share"), std::string::npos);
}

TEST(RobotConfig, RefusesASpringDriveWithoutSpring) {
  expect_error(with("spring_Nm_rad = 395.46\n", ""),
               "robots/leg.toml:12: actuator.big: of order 2: spring_Nm_rad must be positive "
               "(give it, or another order)");
}

TEST(RobotConfig, RefusesNumbersThatAreNotFinite) {
  expect_error(with("damping_s_m = 10\n", "damping_s_m = nan\n"),
               "robots/leg.toml:62: contact.damping_s_m: must be finite");
}

TEST(RobotConfig, RefusesReversedLimits) {
  expect_error(with("max_position_rad = 1.0", "max_position_rad = -2.0"),
               "robots/leg.toml:42: joint[0].min_position_rad: the position limits are reversed or "
               "equal (min_position_rad must be less than max_position_rad)");
}

TEST(RobotConfig, RefusesEncodersWithoutCounts) {
  expect_error(with("\nencoder_counts_per_rev = 65536", "\nencoder_counts_per_rev = 0"),
               "robots/leg.toml:35: joint_defaults.encoder_counts_per_rev: 0 is out of range "
               "(must be greater than 0)");
  expect_error(with("\nencoder_counts_per_rev = 65536", ""),
               "robots/leg.toml:36: joint[0].encoder_counts_per_rev: this key is missing "
               "(add it to the table, or to [joint_defaults] for all)\n"
               "robots/leg.toml:43: joint[1].encoder_counts_per_rev: this key is missing "
               "(add it to the table, or to [joint_defaults] for all)");
}

TEST(RobotConfig, RefusesNodeIdsOffTheBus) {
  expect_error(with("node_id = 3", "node_id = 128"),
               "robots/leg.toml:33: board[0].node_id: 128 is out of range (must be 1 to 127)");
}

TEST(RobotConfig, RefusesASensorWithABoardsNodeId) {
  expect_error(with("node_id = 10", "node_id = 3"),
               "robots/leg.toml:56: sensor[0].node_id: node id 3 is taken on bus 'left' "
               "(every board and sensor of a bus needs an id of its own)");
}

TEST(RobotConfig, RefusesAJointOnTwoBoards) {
  const std::string text =
      with("[joint_defaults]",
           "[[board]]\nname = 'other'\nbus = 'left'\nnode_id = 4\n[joint_defaults]") +
      "[[joint]]\nname = 'hip'\nboard = 'other'\nactuator = 'big'\ngains = 'big'\n";
  expect_error(text,
               "robots/leg.toml:78: joint[2].name: the joint 'hip' is on two boards, 'hip_board' "
               "and 'other' (remove one of the two)");
}

TEST(RobotConfig, RefusesAnAxisTwice) {
  expect_error(with("axis = 1", "axis = 0"),
               "robots/leg.toml:47: joint[1].axis: axis 0 of board 'hip_board' already drives "
               "joint 'hip' (give each joint of a board an axis of its own)");
}

TEST(RobotConfig, RefusesAGapInABoardsAxes) {
  expect_error(with("axis = 1", "axis = 3"),
               "robots/leg.toml:31: board[0].name: the axes of board 'hip_board' have a gap "
               "(number them from 0 without a gap)");
}

TEST(RobotConfig, RefusesABoardWithoutJoint) {
  const std::string text = with(
      "[joint_defaults]", "[[board]]\nname = 'other'\nbus = 'left'\nnode_id = 4\n[joint_defaults]");
  EXPECT_NE(errors_of(text).find("no joint is on board 'other'"), std::string::npos);
}

TEST(RobotConfig, SuggestsTheNearestForAnUnknownReference) {
  const std::string text = with("axis = 1\nactuator = \"big\"\ngains = \"big\"",
                                "axis = 1\nactuator = \"bigg\"\ngains = \"bg\"");
  EXPECT_EQ(errors_of(text),
            "robots/leg.toml:48: joint[1].actuator: there is no actuator 'bigg' "
            "(did you mean 'big'?)\n"
            "robots/leg.toml:49: joint[1].gains: there is no gains table 'bg' "
            "(did you mean 'big'?)\n");
}

TEST(RobotConfig, RefusesAPostureOfAnUnknownJoint) {
  expect_error(with("knee = 0.2", "kne = 0.2"),
               "robots/leg.toml:72: posture.home.kne: there is no joint 'kne' "
               "(did you mean 'knee'?)");
}

TEST(RobotConfig, LeavesTheHeightOfABaseToTheDescription) {
  const auto robot = parse_robot_config(with("= 0.5\nknee", "= \"auto\"\nknee"), "leg.toml");
  ASSERT_TRUE(robot.has_value()) << robot.error()[0].to_string();
  EXPECT_TRUE(std::isnan(robot->postures[0].base_height_m));
  expect_error(with("= 0.5\nknee", "= \"atuo\"\nknee"),
               "robots/leg.toml:71: posture.home.base_height_m: 'atuo' is not one of the choices "
               "(did you mean 'auto'?)");
}

TEST(RobotConfig, ComputesNoHeightWithoutAFoot) {
  std::string text = with("= 0.5\nknee", "= \"auto\"\nknee");
  const std::size_t at = text.find("[contact]");
  text.erase(at, text.find("[posture.home]") - at);
  expect_error(text,
               "robots/leg.toml:61: posture.home.base_height_m: there is no [contact] with a foot "
               "to stand on (add one, or give a number)");
}

TEST(RobotConfig, RefusesAFootWhoseSiteTakesNoWrench) {
  EXPECT_NE(errors_of(with("wrench = true", "wrench = false")).find("takes no wrench"),
            std::string::npos);
}

TEST(RobotConfig, RefusesNoiseOfTheWrongLength) {
  EXPECT_NE(errors_of(with("noise = [1, 1, 1, 0.1, 0.1, 0.1]", "noise = [1, 1]"))
                .find("give one for each of the 6 channels"),
            std::string::npos);
}

TEST(RobotConfig, RefusesALockedJointThatIsDriven) {
  EXPECT_NE(errors_of(with("toe = 0.1", "hip = 0.1")).find("is locked in [model.lock]"),
            std::string::npos);
}

TEST(RobotConfig, RefusesAStaticFrictionBelowTheSlidingOne) {
  EXPECT_NE(errors_of(with("static_friction = 0.9", "static_friction = 0.1"))
                .find("is less than sliding_friction"),
            std::string::npos);
}

TEST(RobotConfig, ReportsAllErrorsInTheFilesOrder) {
  std::string text = with("node_id = 3", "node_id = 300");
  text.replace(text.find("base = \"floating\""), 17, "base = \"flotaing\"");
  const auto robot = parse_robot_config(text, "leg.toml");
  ASSERT_FALSE(robot.has_value());
  ASSERT_GE(robot.error().size(), 2u);
  EXPECT_EQ(robot.error()[0].key, "model.base");
  EXPECT_EQ(robot.error()[0].hint, "did you mean 'floating'?");
}

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
  expect_error(shortened("joints = [\"ankle\"]", "joints = [\"ankle\"], node_id = 127"),
               "robots/leg.toml:34: board[0].node_id: no node id is left after 127 on bus 'left' "
               "(set node_id, here or of the node before)\n"
               "robots/leg.toml:52: sensor[0].node_id: no node id is left after 127 on bus 'left' "
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
               "(did you mean 'gear_ratio'?)\n"
               "robots/leg.toml:13: actuator.big.gear_ratio: this key is missing "
               "(add it to the table, or to [actuator_defaults] for all)");
}

TEST(RobotConfigDefaults, AreCheckedWhenNobodyUsesThem) {
  expect_error(
      "name = 'm'\n[model]\nurdf = 'm.urdf'\nbase = 'fixed'\n"
      "[bus_defaults]\nmax_load = 7\nname = 'x'\n",
      "robots/leg.toml:6: bus_defaults.max_load: 7 is out of range "
      "(must be at least 0.01 and at most 1)\n"
      "robots/leg.toml:7: bus_defaults.name: unknown key (known: bitrate, data_bitrate, fd, "
      "max_load)");
}

TEST(RobotConfigDefaults, RefuseAJointThatNoTableDescribes) {
  expect_error(shortened("\"hip\", \"knee\"]", "\"hip\", \"knee\", \"kneee\"]"),
               "robots/leg.toml:31: bus[0].boards[0].joints: there is no [[joint]] 'kneee' "
               "(did you mean 'knee'?)");
}

TEST(RobotConfigDefaults, RefuseAJointThatNoBoardHas) {
  expect_error(shortened("[\"ankle\", \"hip\"]", "[\"ankle\", \"hip\", \"heel\"]"),
               "robots/leg.toml:46: joint[1].names: no board lists joint 'heel' "
               "(add it to the joints of its board)");
  expect_error(shortened("board = \"toe_board\"\n", ""),
               "robots/leg.toml:35: board[0].name: no joint is on board 'toe_board' "
               "(list its joints, or remove the board)\n"
               "robots/leg.toml:41: joint[0].board: this key is missing "
               "(add it to the table, or the joint to the joints of its board)");
}

TEST(RobotConfigDefaults, RefuseAJointThatTwoBoardsListOrOneTwice) {
  expect_error(shortened("[\"ankle\"]", "[\"ankle\", \"hip\"]"),
               "robots/leg.toml:32: bus[0].boards[1].joints: the joint 'hip' is on two boards, "
               "'hip_board' and 'foot_board' (remove one of the two)");
  expect_error(shortened("[\"ankle\"]", "[\"ankle\", \"ankle\"]"),
               "robots/leg.toml:32: bus[0].boards[1].joints: the joint 'ankle' is listed twice "
               "(remove one of the two)");
}

TEST(RobotConfigDefaults, RefuseABoardForAJointThatIsListed) {
  expect_error(shortened("name = \"knee\"\n", "name = \"knee\"\nboard = \"toe_board\"\n"),
               "robots/leg.toml:50: joint[2].board: board 'hip_board' lists joint 'knee' already "
               "(remove this key)");
}

TEST(RobotConfigDefaults, RefuseAnActuatorWhoseGainsAreMissing) {
  expect_error(shortened("[gains.stiff]\nposition = {kp = 300}\n", "[gains.stif]\n"),
               "robots/leg.toml:43: joint[0].gains: there is no gains table 'stiff' "
               "(did you mean 'stif'?)\n"
               "robots/leg.toml:47: joint[2].gains: there is no [gains.stiff] for the actuator of "
               "that name (add that table, or set gains)");
}

TEST(RobotConfigDefaults, AskForANameOrNames) {
  expect_error(shortened("name = \"knee\"\n", "name = \"knee\"\nnames = [\"knee\"]\n"),
               "robots/leg.toml:50: joint[2].names: a joint's table has a name or names, not both "
               "(remove one of the two)");
}

// The leg with a site on the shank, and what stands behind it.
std::string with_loop(const std::string& text) {
  return std::string(kRobot) + "[[site]]\nname = \"pin\"\nlink = \"shank\"\n" +
         "[[site]]\nname = \"eye\"\nlink = \"pelvis\"\n" + text;
}

TEST(RobotConfig, ReadsLoopsAndPassiveJoints) {
  const auto robot = parse_robot_config(with_loop(R"([[passive]]
name = "slider"
position_rad = 0.3
[[loop]]
name = "hinge"
type = "revolute"
sites = ["pin", "eye"]
axis = [0, 2, 0]
[[loop]]
name = "link"
type = "rod"
sites = ["eye", "pin"]
length_m = 0.2
)"),
                                        "robots/leg.toml");
  ASSERT_TRUE(robot.has_value()) << robot.error().front().to_string();
  ASSERT_EQ(robot->loops.size(), 2u);
  EXPECT_EQ(robot->loops[0].type, model::LoopType::kRevolute);
  EXPECT_EQ(robot->loops[0].axis, (std::array<double, 3>{0, 1, 0}));
  EXPECT_EQ(robot->loops[1].sites, (std::array<std::string, 2>{"eye", "pin"}));
  EXPECT_EQ(robot->loops[1].length_m, 0.2);
  EXPECT_TRUE(robot->is_passive("slider"));
  EXPECT_FALSE(robot->is_passive("knee"));
  EXPECT_EQ(robot->passive[0].position_rad, 0.3);
}

TEST(RobotConfig, SaysWhatIsWrongWithALoop) {
  const auto loop = [](const std::string& keys) {
    return errors_of(with_loop("[[loop]]\nname = \"hinge\"\n" + keys));
  };
  EXPECT_NE(loop("type = \"bal\"\nsites = [\"pin\", \"eye\"]").find("did you mean 'ball'?"),
            std::string::npos);
  EXPECT_NE(loop("type = \"ball\"\nsites = [\"pin\", \"eyes\"]")
                .find("loop[0].sites: there is no [[site]] 'eyes' (did you mean 'eye'?)"),
            std::string::npos)
      << loop("type = \"ball\"\nsites = [\"pin\", \"eyes\"]");
  EXPECT_NE(loop("type = \"ball\"\nsites = [\"pin\"]").find("must name two [[site]]s, and names 1"),
            std::string::npos);
  EXPECT_NE(loop("type = \"ball\"\nsites = [\"pin\", \"pin\"]").find("between two sites, not one"),
            std::string::npos);
  EXPECT_NE(loop("type = \"ball\"\nsites = [\"pin\", \"sole\"]").find("'sole' is a foot's"),
            std::string::npos);
  EXPECT_NE(loop("type = \"revolute\"\nsites = [\"pin\", \"eye\"]").find("needs its axis"),
            std::string::npos);
  EXPECT_NE(loop("type = \"revolute\"\nsites = [\"pin\", \"eye\"]\naxis = [0, 0, 0]")
                .find("has no length"),
            std::string::npos);
  EXPECT_NE(loop("type = \"rod\"\nsites = [\"pin\", \"eye\"]").find("length_m"), std::string::npos);
  EXPECT_NE(errors_of(with_loop("[[passive]]\nname = \"knee\"\n"))
                .find("the joint 'knee' has a motor: it is a [[joint]] too"),
            std::string::npos);
}

class Completed : public testing::Test {
 protected:
  void read(const std::string& text) {
    auto found = parse_robot_config(text, "leg.toml");
    ASSERT_TRUE(found.has_value()) << errors_of(text);
    robot = *found;
    errors.clear();
    for (const Error& error : complete_from_description(robot, description_)) {
      errors += error.to_string() + "\n";
    }
  }
  RobotConfig robot;
  RobotDescription description_ = description();
  std::string errors;
};

TEST_F(Completed, TakesMissingLimitsFromTheDescription) {
  read(kRobot);
  EXPECT_EQ(errors, "");
  EXPECT_EQ(robot.joints[0].max_position_rad, 1.0);
  EXPECT_EQ(robot.joints[1].max_position_rad, 2.0);
  EXPECT_EQ(robot.joints[0].max_torque_Nm, 100.0);
  EXPECT_EQ(robot.joints[0].rated_torque_Nm, 100.0);
  EXPECT_EQ(robot.joints[1].max_torque_Nm, 80.0);
  EXPECT_EQ(robot.joints[1].max_velocity_rad_s, 6.0);
}

TEST_F(Completed, GivesAContinuousJointWhatItsEncoderCounts) {
  description_.moving_joints[1].max_position_rad = INFINITY;
  read(kRobot);
  EXPECT_EQ(errors, "");
  EXPECT_GT(robot.joints[1].max_position_rad, 1e4);
  EXPECT_LT(robot.joints[1].max_position_rad / (2 * M_PI) * 409600, 2147483647.0);
}

TEST_F(Completed, SuggestsTheNearestForAJointThatTheDescriptionLacks) {
  description_.moving_joints[0].name = "hip_pitch";
  description_.moving_joints[1].name = "hipp";
  read(kRobot);
  EXPECT_EQ(errors.substr(0, errors.find('\n')),
            "leg.toml:37: joint.hip: the description has no joint 'hip' (did you mean 'hipp'?)");
}

TEST_F(Completed, RefusesAMovingJointThatNothingDrives) {
  description_.moving_joints.push_back({"wrist", -1, 1, 1, 1});
  read(kRobot);
  EXPECT_EQ(errors,
            "leg.toml: joint: the description's joint 'wrist' has no [[joint]] "
            "(add one or a [[passive]], or fix it with [model.lock] wrist = 0.0)\n");
}

TEST_F(Completed, RefusesAJointThatDoesNotMove) {
  description_.moving_joints.pop_back();
  description_.other_joints.push_back("knee");
  read(kRobot);
  EXPECT_NE(errors.find("'knee' does not move in the description"), std::string::npos);
}

TEST_F(Completed, TakesAMovingJointWithoutAMotorThatIsPassive) {
  description_.moving_joints.push_back({"wrist", -1, 1, 1, 1});
  read(std::string(kRobot) + "[[passive]]\nname = \"wrist\"\n");
  EXPECT_EQ(errors, "");
  read(std::string(kRobot) + "[[passive]]\nname = \"wirst\"\n");
  EXPECT_NE(errors.find("passive.wirst: the description has no joint 'wirst' (did you mean "
                        "'wrist'?)"),
            std::string::npos)
      << errors;
}

TEST_F(Completed, RefusesAMotorForAJointThatFollowsAnother) {
  description_.moving_joints.pop_back();
  description_.followers = {{"knee", "hip", -INFINITY, INFINITY}};
  read(kRobot);
  EXPECT_NE(errors.find("joint.knee: the joint 'knee' mimics 'hip' in the description and has no "
                        "motor of its own (remove the [[joint]], or set mimic = \"independent\" "
                        "in [model])"),
            std::string::npos)
      << errors;
}

TEST_F(Completed, RefusesALimitThatTakesAFollowerBeyondItsOwn) {
  description_.followers = {{"flap", "hip", -1.5, 0.9}};
  read(kRobot);
  EXPECT_NE(errors.find("joint.hip.max_position_rad: would take 'flap', which mimics this joint, "
                        "beyond its own limits (stay within -1.500000 to 0.900000)"),
            std::string::npos)
      << errors;
}

TEST_F(Completed, RefusesUnknownLinksAndJointsOfSitesAndSensors) {
  description_.links.back() = "foott";
  description_.other_joints = {"toe", "ankel"};
  read(kRobot);
  EXPECT_NE(errors.find("leg.toml:7: site.sole.link: the description has no link 'foot' "
                        "(did you mean 'foott'?)"),
            std::string::npos);
  EXPECT_NE(errors.find("sensor.foot_ft.joint: the description has no joint 'ankle'"),
            std::string::npos);
}

TEST_F(Completed, AsksForALimitThatNobodyGives) {
  description_.moving_joints[0].max_velocity_rad_s = 0.0;
  read(kRobot);
  EXPECT_EQ(errors,
            "leg.toml:37: joint.hip.max_velocity_rad_s: neither this file nor the description "
            "gives a limit (set max_velocity_rad_s)\n");
}

TEST_F(Completed, SaysWhyTheDescriptionGivesNoLimits) {
  const double none = std::nan("");
  description_.moving_joints[1] = {"knee", none, none, none, 200.0, "leg.urdf:12 has no <limit>"};
  read(kRobot);
  const std::string why =
      "neither this file nor the description gives a limit (leg.urdf:12 has no <limit>) ";
  const std::string key = "leg.toml:44: joint.knee.";
  EXPECT_EQ(errors, key + "min_position_rad: " + why + "(set min_position_rad)\n" + key +
                        "max_position_rad: " + why + "(set max_position_rad)\n" + key +
                        "max_velocity_rad_s: " + why + "(set max_velocity_rad_s)\n");
}

TEST_F(Completed, TakesEveryLimitFromTheRobotsFileWhenTheDescriptionHasNone) {
  const double none = std::nan("");
  description_.moving_joints[1] = {"knee", none, none, none, none, "has no <limit>"};
  read(with("max_torque_Nm = 80",
            "max_torque_Nm = 80\nmin_position_rad = -1\nmax_position_rad = 2\n"
            "max_velocity_rad_s = 3"));
  EXPECT_EQ(errors, "");
  EXPECT_EQ(robot.joints[1].min_position_rad, -1.0);
  EXPECT_EQ(robot.joints[1].max_velocity_rad_s, 3.0);
}

TEST_F(Completed, RefusesLimitsThatTheEncoderCannotCount) {
  read(with("max_position_rad = 1.0", "max_position_rad = 1e6"));
  EXPECT_NE(errors.find("more than the encoder's 32 bits can count"), std::string::npos);
}

TEST_F(Completed, RefusesATorqueThatTheWireCannotSay) {
  read(with("max_torque_Nm = 80", "max_torque_Nm = 80\nrated_torque_Nm = 1"));
  EXPECT_NE(errors.find("more than 32 times the rated torque"), std::string::npos);
}

TEST_F(Completed, RefusesAPostureBeyondTheLimits) {
  read(with("knee = 0.2", "knee = -0.2"));
  EXPECT_NE(errors.find("posture.home.knee: is beyond the joint's limits"), std::string::npos);
}

}  // namespace
}  // namespace tandem::hal
