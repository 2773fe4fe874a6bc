#include "tests/controllers/harness.hpp"
#include "tests/hal/fake_backend.hpp"

namespace tandem {
namespace {

hal::RobotConfig robot() {
  hal::RobotConfig config = hal::test::fake_robot();
  config.postures.push_back({{"ready", 0.0, {0.5, -0.5, 0.25}}});
  config.postures.push_back({{"wrong", 0.0, {0.0, 2.0, 0.0}}});
  return config;
}

TEST(Hold, KeepsTheMeasuredPositionOfEveryJoint) {
  test::Harness run(robot(), "hold", "");
  ASSERT_EQ(run.problem(), "");
  run.state.position_rad()[1] = 0.3;
  run.start();
  EXPECT_EQ(run.run(1.0), Code::kOk);
  EXPECT_EQ(run.setup.claims().size(), 3U);
  EXPECT_EQ(run.command.position_rad()[1], 0.3);
  EXPECT_EQ(run.command.velocity_rad_s()[1], 0.0);
}

TEST(Hold, KeepsAJointWhoseLimitsLeaveOutZero) {
  hal::RobotConfig config = robot();
  config.joints[1].min_position_rad = 0.2;
  EXPECT_EQ(test::Harness(config, "hold", "").problem(), "");
}

TEST(Hold, LeadsToAPostureWithoutAJump) {
  test::Harness run(robot(), "hold", "posture = 'ready'\nduration_s = 2.0\n");
  ASSERT_EQ(run.problem(), "");
  run.state.position_rad()[0] = -0.5;
  run.start();
  double last = -0.5;
  for (int i = 0; i < 2100; ++i) {
    ASSERT_EQ(run.step(), Code::kOk);
    ASSERT_NEAR(run.command.position_rad()[0], last, 1.875 * 1.0 / 2.0 * 1e-3 + 1e-9);
    last = run.command.position_rad()[0];
  }
  EXPECT_EQ(run.command.position_rad()[0], 0.5);
  EXPECT_EQ(run.command.position_rad()[1], -0.5);
}

TEST(Hold, TakesThreeSecondsToAPostureWhenNothingIsSaid) {
  test::Harness run(robot(), "hold", "posture = 'ready'\n");
  ASSERT_EQ(run.problem(), "");
  run.state.position_rad()[0] = -0.5;
  run.start();
  run.run(1.5);
  EXPECT_NEAR(run.command.position_rad()[0], 0.0, 1e-3) << "half the time, half the way";
  run.run(1.5);
  ASSERT_EQ(run.step(), Code::kOk);
  EXPECT_EQ(run.command.position_rad()[0], 0.5);
}

TEST(Hold, BrakesTheSwingOfALinkOnRequest) {
  test::Harness run(robot(), "hold", "joints = ['wrist']\nlink_damping_Nms_rad = 4.0\n");
  ASSERT_EQ(run.problem(), "");
  run.start();
  run.state.velocity_rad_s()[2] = 0.5;
  ASSERT_EQ(run.step(), Code::kOk);
  EXPECT_EQ(run.command.torque_Nm()[2], -2.0);
  EXPECT_EQ(run.command.torque_Nm()[0], 0.0);
}

TEST(Hold, BrakesTheSwingMoreOrLessAsSoonAsThatIsSet) {
  test::Harness run(robot(), "hold", "");
  ASSERT_EQ(run.problem(), "");
  run.start();
  run.state.velocity_rad_s()[2] = 0.5;
  ASSERT_EQ(run.step(), Code::kOk);
  EXPECT_EQ(run.command.torque_Nm()[2], 0.0);
  run.set("link_damping_Nms_rad", 3.0);
  ASSERT_EQ(run.step(), Code::kOk);
  EXPECT_EQ(run.command.torque_Nm()[2], -1.5);
}

TEST(Hold, ClaimsOnlyTheJointsItIsGiven) {
  test::Harness run(robot(), "hold", "joints = ['wrist']\ninteraction = 'compliant'\n");
  ASSERT_EQ(run.problem(), "");
  ASSERT_EQ(run.setup.claims().size(), 1U);
  EXPECT_EQ(run.setup.claims()[0].joint, 2U);
  EXPECT_EQ(run.setup.claims()[0].interaction, hal::InteractionMode::kCompliant);
}

TEST(Hold, NamesTheLineAndTheNearestOfAWrongName) {
  EXPECT_EQ(test::Harness(robot(), "hold", "\njoints = ['elbwo']\n").problem(),
            "experiment.toml:2: joints: the robot has no joint 'elbwo' (did you mean 'elbow'?)");
  EXPECT_EQ(test::Harness(robot(), "hold", "posture = 'raedy'\n").problem(),
            "experiment.toml:1: posture: the robot has no posture 'raedy' "
            "(did you mean 'ready'?)");
  EXPECT_EQ(test::Harness(robot(), "hold", "psture = 'ready'\n").problem(),
            "experiment.toml:1: psture: unknown key (did you mean 'posture'?)");
  EXPECT_NE(test::Harness(robot(), "hold", "joints = ['wrist', 'wrist']\n").problem(), "");
}

// "the robot has no joint 'finger'", which the robot has.
TEST(Hold, NamesTheLeaderOfAJointThatFollows) {
  hal::RobotConfig config = robot();
  config.followers = {{"finger", 1, -1.0, 0.0}};
  EXPECT_EQ(test::Harness(config, "hold", "joints = ['wrist', 'finger']\n").problem(),
            "experiment.toml:1: joints: the joint 'finger' follows 'elbow' (mimic) (command "
            "'elbow')");
}

TEST(Hold, RefusesAPostureBeyondAJointsLimits) {
  EXPECT_EQ(test::Harness(robot(), "hold", "posture = 'wrong'\n").problem(),
            "experiment.toml:1: posture: is beyond the limits of joint 'elbow' (choose another "
            "posture, or leave the joint out of `joints`)");
}

TEST(Hold, SaysWhereARobotWithoutPosturesGetsOne) {
  hal::RobotConfig config = robot();
  config.postures.clear();
  config.file = "arm/robot.toml";
  EXPECT_EQ(test::Harness(config, "hold", "posture = 'ready'\n").problem(),
            "experiment.toml:1: posture: the robot has no posture 'ready' (add [posture.ready] to "
            "arm/robot.toml)");
}

TEST(Hold, GoesOnFromASnapshot) {
  test::Harness run(robot(), "hold", "posture = 'ready'\n");
  run.start();
  run.run(0.5);
  Archive saved;
  run.controller().archive(saved);
  test::Harness other(robot(), "hold", "posture = 'ready'\n");
  Archive restored(saved.bytes());
  other.controller().archive(restored);
  ASSERT_TRUE(restored.ok() && restored.at_end());
  other.time = run.time;
  run.run(0.5);
  other.run(0.5);
  EXPECT_EQ(other.command.position_rad()[0], run.command.position_rad()[0]);
}

}  // namespace
}  // namespace tandem
