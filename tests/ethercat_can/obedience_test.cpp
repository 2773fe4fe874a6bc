// What the master finds by itself of a drive that stays enabled after a stop.
#include "tests/ethercat_can/deaf_rig.hpp"

namespace tandem::hal::can {
namespace {

using test::DeafRig;
using test::servo;
using test::SheetRig;

constexpr const char* kDisobeys = "a drive does not obey the stop";

TEST(Obedience, AQuickStopThatADriveIgnoresStopsItsBoard) {
  DeafRig rig;
  rig.go_deaf(0.1);
  rig.master->stop(StopCategory::kCategory1);
  rig.steps(495);
  EXPECT_EQ(rig.state.fault()[0], 0U);
  rig.steps(10);
  EXPECT_EQ(rig.master->fault_cause(0), FaultCause::kIgnoresStop);
  EXPECT_NE(rig.state.fault()[0], 0U);
  EXPECT_FALSE(rig.drive.operational()) << "NMT stop";
  EXPECT_NE(rig.told().find(kDisobeys), std::string::npos) << rig.told();
  EXPECT_NE(rig.told().find("joint Joint0 (board board_0, node 5, axis 0): board lost at"),
            std::string::npos)
      << rig.told();
  EXPECT_NE(rig.told().find("cut its power"), std::string::npos) << rig.told();
}

TEST(Obedience, CategoryZeroIsExpectedSooner) {
  DeafRig rig;
  rig.go_deaf(0.1);
  rig.master->stop(StopCategory::kCategory0);
  rig.steps(195);
  EXPECT_EQ(rig.state.fault()[0], 0U);
  rig.steps(10);
  EXPECT_EQ(rig.master->fault_cause(0), FaultCause::kIgnoresStop);
}

TEST(Obedience, ADriveThatStopsIsNoFault) {
  for (const StopCategory category : {StopCategory::kCategory0, StopCategory::kCategory1}) {
    SheetRig rig(servo());
    ASSERT_TRUE(rig.bring_up());
    rig.master->stop(category);
    rig.steps(3000);
    EXPECT_EQ(rig.state.fault()[0], 0U);
    rig.master->reset();
    rig.steps(100);
    EXPECT_EQ(rig.master->phase(), Phase::kOperational) << rig.master->status_text();
  }
}

TEST(Obedience, AHeldDriveMayStayEnabled) {
  SheetRig rig(servo());
  ASSERT_TRUE(rig.bring_up());
  rig.master->stop(StopCategory::kHold);
  rig.steps(3000);
  EXPECT_EQ(rig.state.fault()[0], 0U);
  EXPECT_TRUE(rig.drive.enabled());
}

TEST(Obedience, ADriveThatDoesNotFollowMayNotStopEither) {
  DeafRig rig([](RobotConfig& robot) { robot.joints[0].on_fault = StopCategory::kHold; });
  rig.go_deaf(1.0);
  (void)rig.until_fault();
  EXPECT_EQ(rig.master->fault_cause(0), FaultCause::kNotFollowing);
  rig.steps(510);
  EXPECT_EQ(rig.master->fault_cause(0), FaultCause::kIgnoresStop);
  EXPECT_FALSE(rig.drive.operational());
}

TEST(Obedience, AResetConfiguresTheBoardAnewAndEndsThereWhileItHearsNothing) {
  DeafRig rig;
  rig.go_deaf(0.1);
  rig.master->stop(StopCategory::kCategory1);
  rig.steps(600);
  rig.master->reset();
  rig.steps(4000);
  EXPECT_EQ(rig.master->phase(), Phase::kFault) << "it was reset, and is not enabled";
  EXPECT_EQ(rig.master->fault_cause(0), FaultCause::kNotEnabled);
  EXPECT_FALSE(rig.drive.enabled());
  rig.drive.deaf = false;
  rig.command.position_rad()[0] = rig.state.position_rad()[0];
  rig.master->reset();
  rig.steps(1000);
  EXPECT_EQ(rig.master->phase(), Phase::kOperational) << rig.told();
}

TEST(Obedience, AtTheEndOfARunADriveThatStaysEnabledIsNamed) {
  DeafRig rig;
  rig.go_deaf(0.1);
  int taken = 0;
  while (!rig.end() && taken < 4000) ++taken;
  EXPECT_LT(taken, 510);
  EXPECT_EQ(rig.master->fault_cause(0), FaultCause::kIgnoresStop);
  rig.exchange();
  EXPECT_FALSE(rig.drive.operational()) << "NMT stop was the last that was sent";
  EXPECT_NE(rig.told().find(kDisobeys), std::string::npos) << rig.told();
}

TEST(Obedience, AtTheEndADriveThatIsNotHeardAnyMoreIsNamedToo) {
  SheetRig rig(servo().remove(0x1017), [](RobotConfig& robot) {
    robot.boards[0].command_timeout_cycles = 0;  // its silence is no fault
  });
  ASSERT_TRUE(rig.bring_up());
  rig.drive.deaf = true;
  rig.steps(10);
  rig.drive.boot_ms = 1'000'000;
  rig.drive.lose_power();
  int taken = 0;
  while (!rig.end() && taken < 4000) ++taken;
  EXPECT_NEAR(taken, 1500, 2);
  EXPECT_EQ(rig.master->fault_cause(0), FaultCause::kIgnoresStop) << "enabled, as it said last";
}

TEST(Obedience, AnOrderlyEndNamesNobody) {
  SheetRig rig(servo());
  ASSERT_TRUE(rig.bring_up());
  int taken = 0;
  while (!rig.end() && taken < 4000) ++taken;
  EXPECT_LT(taken, 10);
  EXPECT_EQ(rig.master->status_text(), "");
  rig.exchange();
  EXPECT_EQ(rig.state.fault()[0], 0U);
}

}  // namespace
}  // namespace tandem::hal::can
