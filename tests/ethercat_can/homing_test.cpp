// Homing by the master: what it sends, whatever the drive answers, and what the joint does then.
#include <gtest/gtest.h>

#include "sheet_rig.hpp"

namespace tandem::hal::can {
namespace {

using namespace test;

/// A servo drive that can be homed.
Sheet homing_servo() {
  Sheet s = servo();
  s.add(0x6098, 0, kInteger8, kSetting, 0);
  s.add(0x6099, 1, kUnsigned32, kSetting, 0);
  s.add(0x6099, 2, kUnsigned32, kSetting, 0);
  s.add(0x609A, 0, kUnsigned32, kSetting, 0);
  s.add(0x607C, 0, kInteger32, kSetting, 0);
  return s;
}

/// Its joint stands at 1000 counts, where the drive's power came; home is at -9000 counts.
struct HomingRig : SheetRig {
  explicit HomingRig(const Sheet& s = homing_servo()) : SheetRig(s, homed_joint) {}
  static void homed_joint(RobotConfig& robot) {
    robot.joints[0].homing = HomingConfig{.method = 17,
                                          .speed_rad_s = 1.0,
                                          .zero_speed_rad_s = 0.1,
                                          .acceleration_rad_s2 = 2.0,
                                          .position_rad = -kPi / 2.0,
                                          .timeout_s = 2.0};
  }
  void up() {
    ASSERT_TRUE(bring_up());
    drive.value(0x6064) = 1000;
    follow(1000);
    steps(3);
  }
  void follow(std::int64_t counts) {
    ask(ControlMode::kPosition);
    command.position_rad()[0] = static_cast<double>(counts) * kRadPerCount;
  }
  /// As the loop does it: the joint is idle from the request on.
  void begin() {
    ASSERT_TRUE(master->home(0));
    ask(ControlMode::kIdle);
  }
  /// @return cycles until it is over
  int homes(int most = 4000) {
    int taken = 0;
    while (taken < most && master->homing(0).state == HomingState::kHoming) {
      step();
      ++taken;
    }
    return taken;
  }
};

TEST(Homing, SetsMethodSpeedsAccelerationAndOffsetInTheDrivesUnits) {
  HomingRig rig;
  rig.up();
  EXPECT_EQ(rig.drive.value(0x6098), 17);
  EXPECT_EQ(rig.drive.value(0x6099, 1), 5730) << "1 rad/s of 36000 counts";
  EXPECT_EQ(rig.drive.value(0x6099, 2), 573);
  EXPECT_EQ(rig.drive.value(0x609A), 11459);
  EXPECT_EQ(static_cast<std::int32_t>(rig.drive.value(0x607C)), -9000);
}

TEST(Homing, FindsThePlaceAndHoldsItThere) {
  HomingRig rig;
  rig.up();
  EXPECT_EQ(rig.master->homing(0).state, HomingState::kNotHomed);
  EXPECT_NEAR(rig.state.position_rad()[0], 1000 * kRadPerCount, 1e-9);
  rig.begin();
  rig.steps(30);
  EXPECT_EQ(rig.drive.value(0x6060), 6);
  EXPECT_EQ(rig.drive.value(0x6040) & 0x1F, 0x1F);
  rig.homes();
  EXPECT_EQ(rig.master->homing(0).state, HomingState::kHomed);
  rig.steps(20);
  EXPECT_EQ(rig.drive.value(0x6060), 8) << "its own mode again";
  EXPECT_EQ(static_cast<std::int32_t>(rig.drive.value(0x607A)), -9000) << "and no step";
  EXPECT_NEAR(rig.state.position_rad()[0], -kPi / 2.0, 1e-9);
  EXPECT_TRUE(rig.drive.enabled());
  rig.follow(-8900);
  rig.steps(5);
  EXPECT_EQ(static_cast<std::int32_t>(rig.drive.value(0x6064)), -8900) << "it follows again";
}

/// A command from before the homing is of other counts, and would be a jump of a quarter turn.
TEST(Homing, FollowsNoCommandFromBefore) {
  HomingRig rig;
  rig.up();
  ASSERT_TRUE(rig.master->home(0));
  rig.steps(20);
  rig.homes();
  ASSERT_EQ(rig.master->homing(0).state, HomingState::kHomed);
  rig.steps(100);
  EXPECT_EQ(static_cast<std::int32_t>(rig.drive.value(0x6064)), -9000);
  rig.ask(ControlMode::kIdle);
  rig.steps(1);
  rig.follow(-9000);
  rig.steps(5);
  EXPECT_TRUE(rig.drive.enabled());
}

/// Bits 10 and 12 of the homing before are still set when the next one begins.
TEST(Homing, OfAHomedJointLooksForTheNewAnswer) {
  HomingRig rig;
  rig.up();
  rig.begin();
  rig.homes();
  rig.follow(-9000);
  rig.steps(5);
  rig.drive.homing_ms = 700;
  rig.begin();
  EXPECT_GT(rig.homes(), 700);
  EXPECT_EQ(rig.master->homing(0).state, HomingState::kHomed);
}

TEST(Homing, ADrivesErrorIsToldAndTheJointIsHeld) {
  HomingRig rig;
  rig.up();
  rig.drive.homing_fails = true;
  rig.begin();
  rig.homes();
  EXPECT_EQ(rig.master->homing(0).state, HomingState::kNotHomed);
  EXPECT_EQ(rig.master->homing(0).error, FaultCause::kHomingDrive);
  rig.steps(20);
  EXPECT_EQ(rig.drive.value(0x6060), 8);
  EXPECT_EQ(rig.drive.value(0x6064), 1000);
  EXPECT_EQ(rig.master->phase(), Phase::kOperational) << "it is no fault of the robot";
  rig.drive.homing_fails = false;
  rig.follow(1000);
  rig.steps(3);
  rig.begin();
  rig.homes();
  EXPECT_EQ(rig.master->homing(0).state, HomingState::kHomed) << "the next one may succeed";
  EXPECT_EQ(rig.master->homing(0).error, FaultCause::kNone);
}

TEST(Homing, EndsWhenItsTimeIsOver) {
  HomingRig rig;
  rig.up();
  rig.drive.homing_ms = -1;
  rig.begin();
  const int taken = rig.homes();
  EXPECT_EQ(rig.master->homing(0).error, FaultCause::kHomingTimeout);
  EXPECT_GE(taken, 2000);
  EXPECT_LT(taken, 2600) << "2 s, and half a second of halt";
  EXPECT_EQ(rig.drive.value(0x6040) & 0x10, 0);
  EXPECT_TRUE(rig.drive.enabled());
}

TEST(Homing, HaltsWhenItIsStopped) {
  HomingRig rig;
  rig.up();
  rig.drive.homing_ms = 100000;
  rig.begin();
  rig.steps(100);
  rig.master->stop_homing(0);
  rig.steps(2);
  EXPECT_EQ(rig.drive.value(0x6040) & 0x110, 0x100) << "halt, and no bit 4";
  rig.homes();
  EXPECT_EQ(rig.master->homing(0).error, FaultCause::kHomingStopped);
  EXPECT_EQ(rig.drive.value(0x6064), 1000);
}

TEST(Homing, ADriveThatDoesNotChangeItsModeIsToldOf) {
  HomingRig rig;
  rig.up();
  rig.drive.knows_homing = false;
  rig.begin();
  rig.homes();
  EXPECT_EQ(rig.master->homing(0).error, FaultCause::kHomingMode);
}

TEST(Homing, AFaultAndAStopInterruptIt) {
  for (const bool by_drive : {false, true}) {
    HomingRig rig;
    rig.up();
    rig.drive.homing_ms = 100000;
    rig.begin();
    rig.steps(100);
    by_drive ? rig.drive.fault() : rig.master->stop(StopCategory::kCategory1);
    rig.steps(5);
    EXPECT_EQ(rig.master->homing(0).state, HomingState::kNotHomed) << by_drive;
    EXPECT_EQ(rig.master->homing(0).error, FaultCause::kHomingInterrupted) << by_drive;
    EXPECT_EQ(rig.master->phase(), Phase::kFault) << by_drive;
    EXPECT_FALSE(rig.master->home(0)) << "not before a reset";
  }
}

/// The drive keeps its counts over a fault, and loses them with its power.
TEST(Homing, SurvivesAResetOfFaultsButNoPowerLoss) {
  HomingRig rig;
  rig.up();
  rig.begin();
  rig.homes();
  rig.follow(-9000);
  rig.steps(5);
  rig.drive.fault();
  rig.steps(5);
  ASSERT_EQ(rig.master->phase(), Phase::kFault);
  rig.master->reset();
  rig.steps(300);
  ASSERT_EQ(rig.master->phase(), Phase::kOperational) << rig.master->status_text();
  EXPECT_EQ(rig.master->homing(0).state, HomingState::kHomed);
  Frame reset;  // its power goes and comes back
  reset.length = 2;
  reset.data = {0x81, 0};
  rig.drive.receive(reset);
  rig.steps(20);
  ASSERT_EQ(rig.master->phase(), Phase::kFault);
  rig.master->reset();
  for (int i = 0; i < 5000 && rig.master->phase() != Phase::kOperational; ++i) rig.step();
  ASSERT_EQ(rig.master->phase(), Phase::kOperational) << rig.master->status_text();
  EXPECT_EQ(rig.master->homing(0).state, HomingState::kNotHomed);
}

TEST(Homing, OfAJointWithoutOneIsRefused) {
  SheetRig rig(homing_servo());
  ASSERT_TRUE(rig.bring_up());
  EXPECT_FALSE(rig.master->home(0));
  EXPECT_EQ(rig.master->homing(0).state, HomingState::kNone);
  EXPECT_EQ(rig.drive.value(0x6098), 0) << "and nothing was set";
}

}  // namespace
}  // namespace tandem::hal::can
