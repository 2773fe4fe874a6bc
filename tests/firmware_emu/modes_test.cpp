// Every mode of operation, closed over frames and a motor on a spring.
#include <gtest/gtest.h>

#include <cmath>

#include "rig.hpp"

namespace tandem::firmware::testing {
namespace {

struct Modes : ::testing::Test {
  Rig rig;
  TestJoint& joint = rig.joints[0];
  Command& command = rig.commands[0];
};

TEST_F(Modes, CspBringsTheLinkToItsTargetUnderLoad) {
  joint.link_inertia = 0.5;
  rig.start();
  rig.enable(8);
  joint.load_Nm = -5.0;
  const std::int32_t target = Rig::counts(0.2);
  for (int k = 0; k < 8000; ++k) {
    command.position = std::min(target, k * 100);
    rig.cycle();
  }
  EXPECT_NEAR(joint.q, 0.2, 2.0e-4);
  EXPECT_NEAR(joint.torque(), 5.0, 0.05);
  EXPECT_EQ(rig.error(), 0);
  EXPECT_NE(rig.statusword() & 0x1000, 0);  // it follows the command
}

TEST_F(Modes, CspFollowsAMovingTargetWithVelocityOffset) {
  joint.link_inertia = 0.5;
  rig.start();
  rig.enable(8);
  double worst = 0.0;
  for (int k = 0; k < 6000; ++k) {
    const double phase = 2.0 * std::numbers::pi * 0.25 * k * 1.0e-3;
    command.position = Rig::counts(0.3 * (1.0 - std::cos(phase)));
    command.velocity_offset = Rig::counts(0.3 * 2.0 * std::numbers::pi * 0.25 * std::sin(phase));
    rig.cycle();
    if (k > 2000) worst = std::max(worst, std::abs(0.3 * (1.0 - std::cos(phase)) - joint.q));
  }
  EXPECT_LT(worst, 0.5 * std::numbers::pi / 180.0);
}

TEST_F(Modes, CsvHoldsAVelocityWithoutAPermanentError) {
  joint.link_inertia = 0.5;
  rig.start();
  rig.enable(9);
  command.velocity_offset = Rig::counts(0.4);
  rig.cycles(3500);
  EXPECT_NEAR(joint.v, 0.4, 4.0e-3);
}

TEST_F(Modes, CsvAddsTheTargetAndTheOffset) {
  joint.link_inertia = 0.5;
  rig.start();
  rig.enable(9);
  ASSERT_EQ(rig.write(0x60FF, 0, Rig::counts(0.3)), 0U);
  command.velocity_offset = Rig::counts(-0.5);
  rig.cycles(3500);
  EXPECT_NEAR(joint.v, -0.2, 4.0e-3);
}

TEST_F(Modes, CstPutsItsTorqueOnTheSpring) {
  rig.start();
  rig.enable(10);
  ASSERT_EQ(rig.write<std::int16_t>(0x6071, 0, 100), 0U);
  command.torque_offset = 60;  // 5 Nm + 3 Nm
  rig.cycles(3000);
  EXPECT_NEAR(joint.torque(), 8.0, 0.02);
}

TEST_F(Modes, ImpedanceYieldsByLoadOverStiffness) {
  joint.link_inertia = 0.5;
  rig.start();
  rig.enable(-1);
  joint.load_Nm = -4.0;
  rig.cycles(6000);
  EXPECT_NEAR(joint.q, -4.0 / 100.0, 5.0e-4);
  ASSERT_EQ(rig.write(0x2010, 0, 200.0F), 0U);
  ASSERT_EQ(rig.write(0x2011, 0, 15.0F), 0U);
  rig.cycles(6000);
  EXPECT_NEAR(joint.q, -4.0 / 200.0, 5.0e-4);
}

TEST_F(Modes, VelocityImpedanceMovesAndYields) {
  joint.link_inertia = 0.5;
  joint.link_friction = 0.0;
  rig.start();
  rig.enable(-4);
  command.velocity_offset = Rig::counts(0.2);
  rig.cycles(4000);
  EXPECT_NEAR(joint.v, 0.2, 2.0e-3);
  command.velocity_offset = 0;
  rig.cycles(3000);
  const double free = joint.q;
  joint.load_Nm = -4.0;
  rig.cycles(6000);
  EXPECT_NEAR(joint.q, free - 4.0 / 100.0, 1.0e-3);
}

TEST_F(Modes, OpenLoopGivesAVoltage) {
  rig.start();
  rig.enable(-2);
  ASSERT_EQ(rig.write<std::int16_t>(0x2012, 0, 200), 0U);  // 2 V
  rig.cycles(3000);
  EXPECT_NEAR(rig.drives[0].voltage_V, 2.0, 1.0e-12);
  EXPECT_NEAR(joint.torque(), 4.1 * 2.0 / 0.664, 0.01);
  EXPECT_EQ(rig.object<std::int16_t>(0x2003), 200);
}

TEST_F(Modes, CurrentGivesACurrentWhateverTheMotorDoes) {
  joint.link_inertia = 0.5;
  joint.link_friction = 10.0;
  rig.start();
  rig.enable(-3);
  ASSERT_EQ(rig.write<std::int16_t>(0x2013, 0, 150), 0U);  // 1.5 A
  rig.cycles(2000);
  EXPECT_GT(joint.w, 0.3);  // it turns, against its back-EMF
  double sum_A = 0.0;
  for (int k = 0; k < 1000; ++k) {
    rig.cycle();
    sum_A += joint.i;
  }
  EXPECT_NEAR(sum_A / 1000.0, 1.5, 0.01);
}

TEST_F(Modes, WithoutAModeTheMotorIsShorted) {
  rig.start();
  rig.enable(0);
  EXPECT_TRUE(rig.drives[0].enabled);
  EXPECT_EQ(rig.drives[0].voltage_V, 0.0);
  EXPECT_EQ(rig.statusword() & 0x1000, 0);
}

TEST_F(Modes, NeverDriveMoreThanTheLimits) {
  BoardSetup setup = board_setup();
  setup.axes[0].parameters.current_limit_A = 8.0;
  for (const int mode : {8, 9, 10, -1, -2, -3, -4}) {
    Rig hard(setup);
    hard.joints[0].link_inertia = 0.5;
    hard.start();
    hard.enable(static_cast<std::int8_t>(mode));
    ASSERT_EQ(hard.write<std::int16_t>(0x2012, 0, 30000), 0U);
    ASSERT_EQ(hard.write<std::int16_t>(0x2013, 0, 30000), 0U);
    double worst_A = 0.0;
    double worst_V = 0.0;
    for (int k = 0; k < 60; ++k) {
      hard.commands[0].position = Rig::counts(0.45);
      hard.commands[0].velocity_offset = Rig::counts(7.0);
      hard.commands[0].torque_offset = 30000;
      hard.cycle();
      const TestJoint& j = hard.joints[0];
      worst_A =
          std::max(worst_A, std::abs(hard.drives[0].voltage_V -
                                     j.NK * hard.board.axis(0).measured().motor_velocity_rad_s) /
                                j.R);
      worst_V = std::max(worst_V, std::abs(hard.drives[0].voltage_V));
    }
    EXPECT_LE(worst_A, 8.0 + 1.0e-5) << mode;  // settings travel as REAL32
    EXPECT_LE(worst_V, 40.0) << mode;
    EXPECT_NE(hard.statusword() & 0x0800, 0) << mode;  // internal limit
  }
}

TEST_F(Modes, ChangeInMotionWithoutAStepOfTheVoltage) {
  joint.link_inertia = 0.5;
  rig.start();
  rig.enable(8);
  const int order[] = {10, -1, 8, 9, -4, 8, -3, 9, -2, 8};
  for (int k = 0; k < 10; ++k) {
    for (int n = 0; n < 300; ++n) {
      command.position = Rig::counts(joint.q + 0.01);
      rig.cycle();
    }
    command.mode = static_cast<std::int8_t>(order[k]);
    command.position = Rig::counts(joint.q);
    rig.cycle();  // sent
    const double before = rig.drives[0].voltage_V;
    rig.cycle();  // in force
    ASSERT_EQ(rig.object<std::int8_t>(0x6061), order[k]);
    EXPECT_NEAR(rig.drives[0].voltage_V, before, 1.0e-9) << order[k];
  }
  EXPECT_EQ(rig.error(), 0);
}

}  // namespace
}  // namespace tandem::firmware::testing
