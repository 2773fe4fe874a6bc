// joint_group: a target is approached without a step and without passing it.
#include <cmath>

#include "tests/controllers/biped.hpp"
#include "tests/controllers/harness.hpp"

namespace tandem {
namespace {

struct JointGroup : testing::Test {
  JointGroup() : run(robot(), "joint_group", "share = 0.5\n") {
    EXPECT_EQ(run.problem(), "");
    run.start();
  }
  static hal::RobotConfig robot() {
    hal::RobotConfig robot = test::biped_robot();
    robot.joints.resize(2);
    return robot;
  }
  /// As the loop puts a sample in.
  void tell(double rad) {
    InputBlock& input = run.setup.io->inputs.all.front();
    input.value.assign(input.value.size(), rad);
    input.fresh = input.arrived = true;
    ++input.sequence;
  }
  [[nodiscard]] double reference() const { return run.command.position_rad()[0]; }

  test::Harness run;
};

TEST_F(JointGroup, StaysUntilItIsTold) {
  EXPECT_EQ(run.run(0.5), Code::kOk);
  EXPECT_EQ(reference(), 0.0);
}

TEST_F(JointGroup, GoesThereWithinItsSpeedAndAccelerationAndNoFurther) {
  const hal::DrivenJoint& limit = run.robot.joints[0];
  const double most = 0.5 * limit.max_velocity_rad_s;
  const double to = std::min(0.6, limit.max_position_rad);
  tell(to);
  const double period_s = static_cast<double>(run.time.period_ns) * 1e-9;
  double before = reference(), speed = 0.0, furthest = 0.0;
  for (int i = 0; i < 20'000; ++i) {
    ASSERT_EQ(run.step(), Code::kOk);
    const double now = (reference() - before) / period_s;
    EXPECT_LE(std::abs(now), most * (1 + 1e-9));
    EXPECT_LE(std::abs(now - speed), 2.0 * most / 0.25 * period_s);
    furthest = std::max(furthest, reference());
    speed = now;
    before = reference();
  }
  EXPECT_EQ(reference(), to);
  EXPECT_LE(furthest, to + 1e-6);
}

TEST_F(JointGroup, TurnsBackFromTheReferenceWithoutAStep) {
  tell(0.5);
  ASSERT_EQ(run.run(0.1), Code::kOk);
  const double there = reference();
  EXPECT_GT(there, 0.0);
  tell(-0.1);
  ASSERT_EQ(run.step(), Code::kOk);
  EXPECT_NEAR(reference(), there, 0.01);
  ASSERT_EQ(run.run(20.0), Code::kOk);
  EXPECT_EQ(reference(), -0.1);
}

}  // namespace
}  // namespace tandem
