// What the master finds by itself of a drive that does not follow its command.
#include "tests/ethercat_can/deaf_rig.hpp"

namespace tandem::hal::can {
namespace {

using test::DeafRig;
using test::servo;
using test::SheetRig;

TEST(Following, ADriveThatHearsNoCommandsIsAFaultOfItsJoint) {
  DeafRig rig;
  rig.go_deaf(0.8);
  EXPECT_EQ(rig.until_fault(), 204) << "200 ms, from the second command: the first has no way yet";
  EXPECT_EQ(rig.master->phase(), Phase::kFault);
  EXPECT_EQ(rig.master->fault_cause(0), FaultCause::kNotFollowing);
  EXPECT_EQ(rig.state.fault()[0], 0x8611U);
  EXPECT_EQ(rig.told().find("joint Joint0 (board board_0, node 5, axis 0): does not follow its "
                            "command at "),
            0U)
      << rig.told();
}

TEST(Following, TakesTheFilesLimitsWithAMargin) {
  DeafRig within([](RobotConfig& robot) { robot.joints[0].following_error_rad = 0.2; });
  within.go_deaf(0.29);
  within.steps(1000);
  EXPECT_EQ(within.master->phase(), Phase::kOperational) << "1.5 times the limit";
  DeafRig beyond([](RobotConfig& robot) {
    robot.joints[0].following_error_rad = 0.2;
    robot.joints[0].following_timeout_s = 0.3;
  });
  beyond.go_deaf(0.31);
  EXPECT_EQ(beyond.until_fault(), 404) << "0.1 s more than the limit";
}

TEST(Following, WithoutALimitInTheFileIsTheWayOfATenthOfASecond) {
  DeafRig slow([](RobotConfig& robot) { robot.joints[0].max_velocity_rad_s = 0.5; });
  slow.go_deaf(0.08);
  EXPECT_EQ(slow.until_fault(), 204) << "0.1 s of 0.5 rad/s, and half as much";
  DeafRig given([](RobotConfig& robot) {
    robot.joints[0].max_velocity_rad_s = 0.5;
    robot.joints[0].following_error_rad.line = 1;
  });
  given.go_deaf(0.08);
  given.steps(1000);
  EXPECT_EQ(given.master->phase(), Phase::kOperational);
}

TEST(Following, IsNotWatchedWhereTheFileSaysZero) {
  DeafRig rig([](RobotConfig& robot) { robot.joints[0].following_error_rad = 0.0; });
  rig.go_deaf(1.9);
  rig.steps(2000);
  EXPECT_EQ(rig.master->phase(), Phase::kOperational);
}

TEST(Following, IsOfPositionControlAlone) {
  for (const ControlMode mode : {ControlMode::kVelocity, ControlMode::kTorque}) {
    SheetRig rig(servo());
    ASSERT_TRUE(rig.bring_up());
    rig.ask(mode);
    rig.steps(20);
    rig.drive.deaf = true;
    rig.command.position_rad()[0] = 1.9;
    rig.steps(2000);
    EXPECT_EQ(rig.master->phase(), Phase::kOperational);
  }
}

TEST(Following, OfOurOwnBoardsTheBoardTellsFirst) {
  test::Rig rig;
  rig.bring_up();
  rig.command.position_rad()[0] = 1.9;
  rig.steps(600);
  EXPECT_EQ(rig.state.fault()[0], 0x8611U);
  EXPECT_EQ(rig.master->fault_cause(0), FaultCause::kDrive);
}

TEST(Following, ABlockedJointBrakesAndIsResetWhereItIs) {
  DeafRig rig;
  rig.go_deaf(1.0);
  (void)rig.until_fault();
  rig.drive.deaf = false;
  rig.steps(5);
  EXPECT_EQ(rig.drive.value(0x6040), 0x0002) << "it has no fault of its own: it can brake";
  EXPECT_FALSE(rig.drive.enabled());
  rig.steps(1000);
  EXPECT_EQ(rig.master->fault_cause(0), FaultCause::kNotFollowing) << "it has obeyed";
  rig.command.position_rad()[0] = rig.state.position_rad()[0];
  rig.master->reset();
  rig.steps(100);
  EXPECT_EQ(rig.master->phase(), Phase::kOperational) << rig.told();
  EXPECT_TRUE(rig.drive.enabled());
}

TEST(Following, AWarningGoesOnAndIsToldOnce) {
  DeafRig rig([](RobotConfig& robot) { robot.joints[0].on_fault = StopCategory::kWarn; });
  rig.go_deaf(1.0);
  (void)rig.until_fault();
  EXPECT_EQ(rig.state.fault()[0], 0x8611U);
  EXPECT_EQ(rig.master->phase(), Phase::kOperational);
  rig.command.fault_reset()[0] = 1;
  rig.step();
  rig.command.fault_reset()[0] = 0;
  rig.steps(1500);
  EXPECT_EQ(rig.state.fault()[0], 0x8611U) << "it does not hear that it is disabled";
}

}  // namespace
}  // namespace tandem::hal::can
