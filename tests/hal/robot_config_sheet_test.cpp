// `eds` of a board: its drive's data sheet, and the units that it gives a joint.
#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <limits>
#include <string>

#include "hal/config/capabilities.hpp"
#include "hal/config/robot_config.hpp"
#include "tests/support/scratch_folder.hpp"

namespace tandem::hal {
namespace {

constexpr const char* kArm = R"(name = "arm"
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

  tandem::test::ScratchFolder folder;
  std::string sheet;
};

TEST_F(BoardSheet, GivesTheDrivesIdentityAndUnits) {
  const auto robot = read();
  ASSERT_TRUE(robot) << robot.error()[0].to_string();
  const BoardConfig& board = robot->boards[0];
  EXPECT_EQ(board.sheet->vendor, 0xFFF1U);
  EXPECT_EQ(board.boot_time_ns, 6'000'000'000);
  const JointConfig& joint = robot->joints[0];
  EXPECT_EQ(joint.encoder_counts_per_rev, 4096.0 * 50.0) << "608F times 6091";
  EXPECT_EQ(joint.rated_torque_Nm, 25.0) << "0.5 Nm at the motor, 6076, times 6091";
  EXPECT_TRUE(joint.counts_of_sheet && joint.torque_of_sheet) << "to be compared with the drive";
}

TEST_F(BoardSheet, IsOverruledByTheRobotsUnits) {
  const auto robot = read(with(kArm, "max_torque_Nm = 10.0\n",
                               "max_torque_Nm = 10.0\nencoder_counts_per_rev = 36000\n"
                               "rated_torque_Nm = 12\n"));
  ASSERT_TRUE(robot) << robot.error()[0].to_string();
  const JointConfig& joint = robot->joints[0];
  EXPECT_EQ(joint.encoder_counts_per_rev, 36000.0);
  EXPECT_EQ(joint.rated_torque_Nm, 12.0);
  EXPECT_FALSE(joint.counts_of_sheet || joint.torque_of_sheet);
}

TEST_F(BoardSheet, LetsAJointHaveADirectionAndAZero) {
  const std::string turned =
      with(kArm, "max_torque_Nm = 10.0\n",
           "max_torque_Nm = 10.0\nreversed = true\nzero_counts = -2147483648\n");
  const auto robot = read(turned);
  ASSERT_TRUE(robot) << robot.error()[0].to_string();
  EXPECT_TRUE(robot->joints[0].reversed);
  EXPECT_EQ(robot->joints[0].zero_counts, std::numeric_limits<std::int32_t>::min());
  const auto own = read(with(with(turned, "eds = \"drive.eds\"\n", ""), "reversed = true\n",
                             "reversed = true\nencoder_counts_per_rev = 36000\n"
                             "motor_encoder_counts_per_rev = 36000\n"));
  ASSERT_FALSE(own);
  ASSERT_EQ(own.error().size(), 2U);
  EXPECT_NE(own.error()[0].to_string().find("reversed: is for drives of other makers"),
            std::string::npos)
      << own.error()[0].to_string();
}

TEST_F(BoardSheet, WithoutUnitsAsksForThemByName) {
  sheet = with(sheet, "DefaultValue=4096", "DefaultValue=1");
  sheet = with(sheet, "DefaultValue=50\n", "DefaultValue=1\n");
  const std::string counts = refused();
  EXPECT_NE(counts.find("encoder_counts_per_rev"), std::string::npos) << counts;
  EXPECT_NE(counts.find("'elbow'"), std::string::npos) << counts;
  sheet = with(sheet, "DefaultValue=500\n", "DefaultValue=0\n");
  const auto both = read();
  ASSERT_FALSE(both);
  ASSERT_EQ(both.error().size(), 2U);
  EXPECT_NE(both.error()[1].to_string().find("6076 has no value"), std::string::npos);
}

TEST_F(BoardSheet, ThatCannotBeReadIsRefusedWithItsOwnLine) {
  sheet = with(sheet, "AccessType=const", "AccessType=sometimes");
  const std::string error = refused();
  EXPECT_NE(error.find("robot.toml"), std::string::npos) << error;
  EXPECT_NE(error.find("drive.eds:"), std::string::npos) << error;
  EXPECT_NE(error.find("sometimes"), std::string::npos) << error;
  const std::string missing = refused(with(kArm, "eds = \"drive.eds\"", "eds = \"other.eds\""));
  EXPECT_NE(missing.find("other.eds"), std::string::npos) << missing;
  const std::string folder_of_it = refused(with(kArm, "eds = \"drive.eds\"", "eds = \".\""));
  EXPECT_NE(folder_of_it.find("is a folder"), std::string::npos) << folder_of_it;
}

TEST_F(BoardSheet, LetsAControllerClaimOnlyTheDrivesModes) {
  const auto robot = read();
  ASSERT_TRUE(robot);
  EXPECT_TRUE(check_capability(*robot, 0, ControlMode::kPosition));
  EXPECT_TRUE(check_capability(*robot, 0, ControlMode::kVelocity)) << "its loops are its own";
  EXPECT_TRUE(check_capability(*robot, 0, ControlMode::kTorque));
  for (const auto mode : {ControlMode::kOpenLoop, ControlMode::kCurrent}) {
    EXPECT_FALSE(check_capability(*robot, 0, mode));
  }
  const Status soft =
      check_capability(*robot, 0, ControlMode::kPosition, InteractionMode::kCompliant);
  ASSERT_FALSE(soft);
  EXPECT_NE(soft.error().to_string().find("joint 'elbow'"), std::string::npos);
  EXPECT_NE(soft.error().to_string().find("tandem eds show"), std::string::npos);
}

}  // namespace
}  // namespace tandem::hal
