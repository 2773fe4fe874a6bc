// An operator's motions: tandem joint move.
#include <cmath>
#include <limits>

#include "tests/runtime/loop_run.hpp"

namespace tandem::runtime {
namespace {

using test::kNow;

struct JointMoves : test::JointServices {
  [[nodiscard]] std::string move(const std::string& joint, const MoveRequest& wish) const {
    return text(services().move_joint(joint, wish, kNow), "asked");
  }
  /// By the loop, to what was asked last.
  [[nodiscard]] std::string answered(const std::string& joint, const MoveRequest& wish) {
    return text(while_cycling([&] { return services().move_joint(joint, wish); }), "done");
  }
};

TEST_F(JointMoves, GoOnATrapezoidAndStayWhereTheyEnd) {
  const double from = reference(1);
  EXPECT_EQ(move("elbow", {.target_rad = from + 0.4, .speed_rad_s = 0.5}), "asked");
  double last = from, fastest = 0.0;
  for (int i = 0; i < 2000; ++i) {
    steps(1);
    const double speed = (reference(1) - last) / 1e-3;
    EXPECT_GE(speed, -1e-9);
    EXPECT_LE(std::abs(speed - fastest), 2e-3) << "1 rad/s^2: half a second to its speed" << i;
    fastest = speed;
    last = reference(1);
  }
  EXPECT_EQ(reference(1), from + 0.4);
  EXPECT_NEAR(cycle->state().position_rad()[1], from + 0.4, 1e-3);
}

TEST_F(JointMoves, BrakeWhenTheyAreStoppedAndGoOverIntoAnotherTarget) {
  const double from = reference(1);
  EXPECT_EQ(move("elbow", {.target_rad = from + 1.0, .speed_rad_s = 0.5}), "asked");
  steps(1000);
  EXPECT_EQ(move("elbow", {}), "asked");
  steps(1000);
  const double rests = reference(1);
  steps(100);
  EXPECT_EQ(reference(1), rests);
  EXPECT_NEAR(rests - from, 0.125 + 0.25 + 0.125, 2e-3) << "0.5 s up, 0.5 s at speed, 0.5 s down";
  EXPECT_EQ(move("elbow", {.target_rad = from, .speed_rad_s = 2.0, .acceleration_rad_s2 = 8.0}),
            "asked");
  steps(1500);
  EXPECT_EQ(reference(1), from);
}

/// A joint in its limit is not beyond it.
TEST_F(JointMoves, ReachBothLimitsAndLeaveThemAgain) {
  for (const double limit : {1.5, -1.5}) {
    EXPECT_EQ(answered("elbow", {.target_rad = limit, .speed_rad_s = 2.0}), "done");
    steps(3000);
    ASSERT_EQ(reference(1), limit);
    EXPECT_EQ(answered("elbow", {.target_rad = 0.0, .speed_rad_s = 2.0}), "done");
    steps(3000);
    EXPECT_EQ(reference(1), 0.0);
  }
}

TEST_F(JointMoves, AreRefusedBeyondTheLimitsAndOfJointsThatAreTaken) {
  const auto has = [](const std::string& text, const char* words) {
    EXPECT_NE(text.find(words), std::string::npos) << text;
  };
  has(move("elbow", {.target_rad = 1.6}),
      "the target 1.6 rad (91.67 deg) is beyond the joint's limits (give -1.5 to 1.5 rad, which "
      "is -85.94 to 85.94 deg)");
  has(move("elbow", {.target_rad = std::numeric_limits<double>::infinity()}), "is beyond");
  has(move("elbow", {.target_rad = 0.0, .speed_rad_s = 2.1}),
      "the speed 2.1 rad/s (120.3 deg/s) is");
  has(move("elbow", {.target_rad = 0.0, .speed_rad_s = 0.0}), "the speed 0 rad/s (0 deg/s) is");
  has(move("elbow", {.target_rad = 0.0, .acceleration_rad_s2 = -1.0}),
      "the acceleration -1 rad/s2 (-57.3 deg/s2) is");
  has(move("elbwo", {.target_rad = 0.0}), "did you mean 'elbow'?");
  has(answered("shoulder", {.target_rad = 0.0}), "is claimed by the controller 'sine'");
  ASSERT_TRUE(mode("elbow", hal::ControlMode::kVelocity));
  has(answered("elbow", {.target_rad = 0.0}), "is not in position control");
  cycle->inbox().emergency_stop(hal::StopCategory::kCategory1);
  steps(1);
  has(move("wrist", {.target_rad = 0.0}), "the run is in the phase shut-down");
}

TEST_F(JointMoves, EndWhenAControllerTakesTheJoint) {
  const double from = reference(1);
  ASSERT_TRUE(while_cycling([&] {
    return services().load("wave", std::make_shared<test::Sine>(std::vector<std::size_t>{1}),
                           *TomlDocument::parse("", "none.toml"));
  }));
  EXPECT_EQ(move("elbow", {.target_rad = from + 1.0, .speed_rad_s = 0.5}), "asked");
  steps(1000);
  ASSERT_TRUE(services().switch_controllers({}, {"wave"}, kNow));
  steps(500);
  EXPECT_LT(std::abs(cycle->command().position_rad()[1] - cycle->state().position_rad()[1]), 0.2);
  ASSERT_TRUE(services().switch_controllers({"wave"}, {}, kNow));
  steps(300);  // it brakes
  const double left = reference(1);
  steps(1000);
  EXPECT_EQ(reference(1), left) << "the motion of before does not go on";
}

TEST_F(JointMoves, GoOnFromASnapshot) {
  EXPECT_EQ(move("elbow", {.target_rad = reference(1) + 1.0}), "asked");
  steps(300);
  const auto snapshot = cycle->save();
  ASSERT_TRUE(snapshot) << snapshot.error().to_string();
  steps(100);
  const double then = reference(1);
  ASSERT_TRUE(cycle->restore(*snapshot));
  EXPECT_LT(reference(1), then);
  steps(100);
  EXPECT_EQ(reference(1), then);
}

TEST(JointMove, KeepsTheJointsAccelerationWhatIsAskedForAndWhatIsNot) {
  hal::RobotConfig config = hal::test::fake_robot();
  config.joints[1].max_acceleration_rad_s2 = 1.0;
  test::JointRun run(config);
  run.add_sine();
  run.begin({.settle_cycles = 20});
  run.steps(100);
  const auto move = [&](double acceleration) {
    return test::JointRun::text(run.services().move_joint(
        "elbow", {.target_rad = 1.4, .speed_rad_s = 1.0, .acceleration_rad_s2 = acceleration},
        kNow));
  };
  EXPECT_NE(move(1e9).find("the acceleration 1e+09 rad/s2"), std::string::npos);
  EXPECT_NE(move(1.01).find("give more than 0, at most 1 rad/s2"), std::string::npos);
  EXPECT_EQ(move(MoveRequest::kDefault), "accepted") << "the speed in half a second is too hard";
  double before = run.reference(1), speed = 0.0, hardest = 0.0;
  for (int i = 0; i < 3000; ++i) {
    run.steps(1);
    const double now = (run.reference(1) - before) * 1e3;
    hardest = std::max(hardest, std::abs(now - speed) * 1e3);
    speed = now;
    before = run.reference(1);
  }
  EXPECT_NEAR(hardest, 1.0, 1e-3);
  EXPECT_EQ(run.reference(1), 1.4);
}

}  // namespace
}  // namespace tandem::runtime
