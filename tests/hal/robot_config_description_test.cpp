// A robot.toml beside its description: limits that it leaves open, names that do not fit.
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include "hal/config/capabilities.hpp"
#include "tests/hal/robot_config_text.hpp"
#include "tests/support/scratch_folder.hpp"

namespace tandem::hal {
namespace {

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

TEST_F(Completed, KnowsWhichJointsSlide) {
  description_.moving_joints[1].slides = true;
  read(kRobot);
  EXPECT_FALSE(robot.joints[0].slides);
  EXPECT_TRUE(robot.joints[1].slides);
  EXPECT_FALSE(robot_of(robot).joints[0].slides);
  EXPECT_TRUE(robot_of(robot).joints[1].slides) << "controllers know it too";
}

// 0.5, a joint's that turns, was 0.5 m: a slide with less travel than that never tripped.
TEST_F(Completed, WatchesWhatSlidesMoreClosely) {
  read(kRobot);
  EXPECT_EQ(robot.joints[1].following_error_rad, 0.5);
  description_.moving_joints[1].slides = true;
  description_.moving_joints[1].max_velocity_rad_s = 0.3;
  read(kRobot);
  EXPECT_DOUBLE_EQ(robot.joints[1].following_error_rad, 0.03) << "the way of 0.1 s";
  EXPECT_EQ(robot.joints[0].following_error_rad, 0.5) << "it turns";
  description_.moving_joints[1].min_position_rad = -0.01;
  description_.moving_joints[1].max_position_rad = 0.03;
  read(kRobot);
  EXPECT_DOUBLE_EQ(robot.joints[1].following_error_rad, 0.02) << "half its travel";
  description_.moving_joints[1].max_position_rad = 10.0;
  description_.moving_joints[1].max_velocity_rad_s = 20.0;
  read(kRobot);
  EXPECT_EQ(robot.joints[1].following_error_rad, 0.5) << "no more than of a joint that turns";
  read(with(kRobot, "[[joint]]", "following_error_rad = 0.4\n"));
  EXPECT_EQ(robot.joints[1].following_error_rad, 0.4) << "what the file says, it says";
}

TEST_F(Completed, GivesAContinuousJointWhatItsEncoderCounts) {
  description_.moving_joints[1].max_position_rad = INFINITY;
  read(kRobot);
  EXPECT_EQ(errors, "");
  EXPECT_GT(robot.joints[1].max_position_rad, 1e4);
  EXPECT_LT(robot.joints[1].max_position_rad / (2 * M_PI) * 409600, 2147483647.0);
}

/// 32 bits count positions: neither the description's limits are narrowed, nor is a posture blamed.
TEST_F(Completed, RefusesMoreCountsThanItsRangeHasRoomFor) {
  const auto counts = [](const char* number) {
    return with("motor_encoder_counts_per_rev = 409600",
                std::string("motor_encoder_counts_per_rev = ") + number);
  };
  read(counts("4294967295"));
  EXPECT_EQ(errors, "");
  read(counts("4294967296"));
  EXPECT_EQ(errors.substr(0, errors.find(" (")),
            "leg.toml:37: joint.hip.motor_encoder_counts_per_rev: 4294967296 does not fit the 32 "
            "bits of 2033");
  description_.moving_joints[1].max_position_rad = 3.0;
  read(counts("4294967295"));
  EXPECT_EQ(errors,
            "leg.toml:44: joint.knee.motor_encoder_counts_per_rev: the joint's limits, 0 to 3, "
            "would be up to 2.051e+09 counts, and the 32 bits of 6064 and 607A take 1.933e+09 "
            "(give at most 4047911309 counts, or narrow min_position_rad and max_position_rad)\n");
}

TEST_F(Completed, RefusesAVelocityThatItsEncoderCannotCount) {
  description_.moving_joints[0].max_velocity_rad_s = 1e6;
  read(kRobot);
  EXPECT_EQ(errors.substr(0, errors.find(" (606C")),
            "leg.toml:37: joint.hip.max_velocity_rad_s: 1e+06 rad/s would be 1.04e+10 counts per "
            "second, which are integers of 32 bits");
}

TEST_F(Completed, SuggestsTheNearestForAJointThatTheDescriptionLacks) {
  description_.moving_joints[0].name = "hip_pitch";
  description_.moving_joints[1].name = "hipp";
  read(kRobot);
  EXPECT_EQ(errors.substr(0, errors.find('\n')),
            "leg.toml:37: joint.hip: the description has no joint 'hip' (did you mean 'hipp'?)");
}

/// What a text without other errors says of names, beside the description.
std::string names_wrong(const std::string& text, const RobotDescription& d = description()) {
  const test::ScratchFolder folder;
  const std::string file = folder / "names.toml";
  std::ofstream(file) << text;
  Diagnostics errors;
  std::vector<JointReference> loose;
  const RobotConfig robot = read_robot_config(TomlDocument::load(file), errors, loose);
  EXPECT_TRUE(errors.empty()) << errors.front().to_string();
  std::string all;
  for (const Error& error : check_names(robot, d, loose)) {
    all += error.to_string().substr(file.size()) + "\n";
  }
  return all;
}

TEST(RobotConfigNames, ReportAMisspeltJointOnceWhereItIsMisspelt) {
  EXPECT_EQ(names_wrong(with("name = \"knee\"", "name = \"kneee\"")),
            ":44: joint.kneee: the description has no joint 'kneee' (did you mean 'knee'?)\n");
  EXPECT_EQ(names_wrong(with("knee = 0.2", "kneee = 0.2")),
            ":72: posture.home.kneee: the description has no joint 'kneee' (did you mean "
            "'knee'?)\n");
}

TEST(RobotConfigNames, ReportAJointWithoutItsTableOnceWhateverNamesIt) {
  std::string text = kRobot;
  const std::size_t knee = text.find("[[joint]]\nname = \"knee\"");
  text.erase(knee, text.find("[[sensor]]") - knee);
  EXPECT_EQ(names_wrong(text),
            ":64: posture.home.knee: there is no [[joint]] 'knee' (add one with its actuator)\n");
  const std::size_t axis = text.find("node_id = 3\n");
  text.insert(axis, "joints = [\"hip\", \"knee\"]\n");
  text.erase(text.find("board = \"hip_board\"\n"), 20);
  EXPECT_EQ(
      names_wrong(text),
      ":33: board.hip_board.joints: there is no [[joint]] 'knee' (add one with its actuator)\n");
}

TEST(RobotConfigNames, SayWhyAPostureCannotPlaceAJoint) {
  RobotDescription d = description();
  d.followers.push_back({"finger", "knee", -1.0, 1.0});
  EXPECT_EQ(names_wrong(with("knee = 0.2", "finger = 0.2"), d),
            ":72: posture.home.finger: the joint 'finger' mimics 'knee' in the description "
            "(remove it here: it follows)\n");
  EXPECT_EQ(names_wrong(with("knee = 0.2", "ankle = 0.2"), d),
            ":72: posture.home.ankle: the joint 'ankle' does not move in the description "
            "(remove it here)\n");
}

TEST_F(Completed, RefusesAMovingJointThatNothingDrives) {
  description_.moving_joints.push_back({"wrist", -1, 1, 1, 1});
  read(kRobot);
  EXPECT_EQ(errors,
            "leg.toml: joint: the description's joint 'wrist' has no [[joint]] "
            "(add one or a [[passive]], or fix it with [model.lock] wrist = 0.0)\n");
}

TEST_F(Completed, RefusesManyMovingJointsThatNothingDrivesInOneMessage) {
  for (const char* name : {"a", "b", "c", "d", "e"}) {
    description_.moving_joints.push_back({name, -1, 1, 1, 1});
  }
  read(kRobot);
  EXPECT_EQ(errors,
            "leg.toml: joint: the description's joints 'a', 'b' and 3 more have no [[joint]] "
            "(add one or a [[passive]], or fix it with [model.lock] a = 0.0)\n");
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

/// A thousand times COMAN's gains gave torque steps of 183 Nm from one millisecond to the next.
TEST_F(Completed, RefusesGainsThatNoJointCanUse) {
  read(with("kp = 200, kd = 5", "kp = 2e6, kd = 5"));
  EXPECT_EQ(
      errors,
      "leg.toml:22: gains.big.position: kp = 2e+06 is beyond 1e+06, the most that the joint's "
      "limits can use (correct the gain, or the limits of hip)\n")
      << "one message for both joints, at the table";
  read(with("torque = {kp = 0.3}", "torque = {kp = 300}"));
  EXPECT_NE(errors.find("gains.big.torque: kp = 300 is beyond 40"), std::string::npos) << errors;
}

TEST_F(Completed, SaysWhyTheDescriptionGivesNoLimits) {
  const double none = std::nan("");
  description_.moving_joints[1] = {"knee", none, none, none, 200.0, "leg.urdf:12 has no <limit>"};
  read(kRobot);
  EXPECT_EQ(errors,
            "leg.toml:44: joint.knee: neither this file nor the description gives a limit "
            "(leg.urdf:12 has no <limit>) (set min_position_rad, max_position_rad and "
            "max_velocity_rad_s)\n");
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
  EXPECT_NE(
      errors.find("joint.hip.motor_encoder_counts_per_rev: the joint's limits, -1.5 to 1e+06"),
      std::string::npos)
      << errors;
}

TEST_F(Completed, RefusesATorqueThatTheWireCannotSay) {
  read(with("max_torque_Nm = 80", "max_torque_Nm = 80\nrated_torque_Nm = 1"));
  EXPECT_NE(errors.find("more than 32 times the rated torque"), std::string::npos);
  // 80 Nm in mNm, as the object has it: every torque became 0 on the wire, and nothing was said.
  read(with("max_torque_Nm = 80", "max_torque_Nm = 80\nrated_torque_Nm = 80000"));
  EXPECT_NE(errors.find("has less than ten of these steps (it is in Nm, object 6076 in mNm"),
            std::string::npos)
      << errors;
}

TEST_F(Completed, RefusesAPostureBeyondTheLimits) {
  read(with("knee = 0.2", "knee = -0.2"));
  EXPECT_NE(errors.find("posture.home.knee: is beyond the joint's limits"), std::string::npos);
}

TEST_F(Completed, RefusesATorqueRateThatControlsNothingOrThatTheWireCannotSay) {
  read(with("max_torque_Nm = 80", "max_torque_Nm = 80\nmax_torque_rate_Nm_s = 79"));
  EXPECT_NE(errors.find("max_torque_rate_Nm_s: the joint would need more than a second"),
            std::string::npos)
      << errors;
  read(with("max_torque_Nm = 80", "max_torque_Nm = 80\nmax_torque_rate_Nm_s = 1e9"));
  EXPECT_NE(errors.find("max_torque_rate_Nm_s: is beyond the range of the wire"), std::string::npos)
      << errors;
  read(with("max_torque_Nm = 80", "max_torque_Nm = 80\nmax_torque_rate_Nm_s = 80"));
  EXPECT_EQ(errors, "");
  EXPECT_EQ(torque_rate_Nm_s(robot.joints[1]), 80.0);
  read(with("max_torque_Nm = 80", "max_torque_Nm = 80"));
  EXPECT_EQ(torque_rate_Nm_s(robot.joints[1]), 80'000.0) << "all of it in a millisecond";
}

}  // namespace
}  // namespace tandem::hal
