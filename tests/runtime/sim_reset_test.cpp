// Stop, reset and emergency stop through the whole chain, of a joint in motion under gravity.
#include "tests/runtime/swing_loop.hpp"

namespace tandem::runtime {
namespace {

using hal::FaultKind;
using hal::StopCategory;

/// The swing on a sine of 0.5 rad, whose faults wait for a reset.
struct Swing : ::testing::Test, test::SwingLoop {
  void begin(StopCategory on_fault, AfterReset after_reset = AfterReset::kContinue) {
    hal::RobotConfig config = tandem::test::swing_robot();
    config.joints[0].on_fault = on_fault;
    config.joints[0].min_position_rad = min_position_rad;
    config.emergency_stop =
        on_fault == StopCategory::kCategory0 ? on_fault : StopCategory::kCategory1;
    of(std::move(config));
    add_sine();
    SwingLoop::begin(
        {.settle_cycles = 200, .after_stop = AfterStop::kWait, .after_reset = after_reset});
    until(RunPhase::kRunning);
    first_start_Nm = torque_step(50);
    steps(980);  // in full motion
  }
  int until(RunPhase phase) { return LoopRun::until(phase, 6000); }
  void inject(FaultKind kind, int cycles) {
    sim::ScenarioFault fault;
    fault.kind = kind;
    (kind == FaultKind::kEncoderUnplug ? fault.joint : fault.board) = 0;
    fault.duration_ns = std::int64_t{cycles} * 1'000'000;
    ASSERT_EQ(backend->robot().inject(fault), Code::kOk);
  }
  /// Until the joint hangs still: nothing but friction brakes it once its bridge is open.
  void come_to_rest() {
    for (int still = 0, taken = 0; still < 500 && taken < 60'000; ++taken) {
      ASSERT_TRUE(cycle->step());
      still = std::abs(backend->plant().joint(0).velocity_rad_s) < 1e-3 ? still + 1 : 0;
    }
    ASSERT_LT(std::abs(backend->plant().joint(0).velocity_rad_s), 1e-3);
  }
  [[nodiscard]] bool powered() const {
    return backend->robot().board(0).axis(0).machine().motion() != canopen::DriveMotion::kNone;
  }

  double min_position_rad = -3.0;
  double first_start_Nm = 0.0;  ///< torque_step() of the controller's own beginning, at first
};

// A jump of the reference by a hundredth of a radian would be 6 Nm at once (kp = 600 Nm/rad). At
// rest, what a cycle may change is the torque sensor's quantum of 0.05 Nm, twice.
TEST_F(Swing, GoesOnWithoutABumpAfterTheResetOfAFaultOfAnyCategory) {
  constexpr double kBump_Nm = 0.11;
  for (const StopCategory category : {StopCategory::kCategory0, StopCategory::kCategory1,
                                      StopCategory::kHold, StopCategory::kWarn}) {
    SCOPED_TRACE(to_string(category));
    begin(category);
    inject(FaultKind::kEncoderUnplug, 5);
    const double before = cycle->state().position_rad()[0];
    come_to_rest();
    const double rest = cycle->state().position_rad()[0];
    ASSERT_GT(std::abs(rest - before), 0.05) << "the reference from before would be a bump";
    ASSERT_EQ(cycle->fault_log().latched(), 1U);
    cycle->inbox().reset_faults();
    until(RunPhase::kSettling);
    EXPECT_NEAR(cycle->command().position_rad()[0], rest, 1e-4);
    EXPECT_LT(torque_step(199), kBump_Nm) << "while it is held";
    const double held = cycle->command().position_rad()[0];
    until(RunPhase::kRunning);
    EXPECT_NEAR(cycle->command().position_rad()[0], held, 1e-5) << "from what has held it";
    EXPECT_LT(torque_step(50), first_start_Nm + kBump_Nm) << "as at the first start";
    EXPECT_EQ(cycle->fault_log().latched(), 0U);
  }
}

TEST_F(Swing, IsHeldAfterAResetAndLedOverWithoutABumpWhenItsControllerIsStarted) {
  constexpr double kBump_Nm = 0.11;
  begin(StopCategory::kCategory1, AfterReset::kHold);
  inject(FaultKind::kEncoderUnplug, 5);
  come_to_rest();
  const double rest = cycle->state().position_rad()[0];
  cycle->inbox().reset_faults();
  until(RunPhase::kHeld);
  EXPECT_LT(torque_step(2000), kBump_Nm);
  EXPECT_EQ(cycle->phase(), RunPhase::kHeld);
  EXPECT_NEAR(cycle->state().position_rad()[0], rest, 0.02) << "it moves by its weight only";
  const double held = cycle->command().position_rad()[0];
  ASSERT_TRUE(cycle->services().go_on(RunServices::Patience{0}));
  steps(1);
  EXPECT_EQ(cycle->phase(), RunPhase::kRunning);
  EXPECT_NEAR(cycle->command().position_rad()[0], held, 1e-3) << "from where it was held";
  EXPECT_LT(torque_step(50), first_start_Nm + kBump_Nm) << "as at the first start";
}

/// Whatever the drive, its axis and the master are at: reset, on the way up, held.
TEST_F(Swing, IsWithoutPowerAfterAStopInAnyCycleOfItsReset) {
  for (const int into : {0, 1, 2, 3, 5, 8, 13, 21, 34, 55, 89}) {
    SCOPED_TRACE(into);
    begin(StopCategory::kCategory1, AfterReset::kHold);
    cycle->inbox().emergency_stop(StopCategory::kCategory1);
    steps(500);
    cycle->inbox().reset_faults();
    steps(into);
    cycle->inbox().emergency_stop(StopCategory::kCategory0);
    steps(500);
    EXPECT_EQ(cycle->phase(), RunPhase::kFaulted);
    EXPECT_FALSE(powered());
    cycle->inbox().reset_faults();
    until(RunPhase::kHeld);
    EXPECT_TRUE(powered()) << "the next one is carried out";
  }
}

/// One amplifier's fault, while the run is stopped: nothing is enabled by its reset.
TEST_F(Swing, StaysDisabledWhenOnlyItsDriveIsReset) {
  begin(StopCategory::kCategory1, AfterReset::kHold);
  inject(FaultKind::kEncoderUnplug, 5);
  come_to_rest();
  ASSERT_NE(cycle->state().fault()[0], 0U);
  ASSERT_TRUE(cycle->services().reset_joint("swing", RunServices::Patience{0}));
  steps(100);
  EXPECT_EQ(cycle->state().fault()[0], 0U);
  EXPECT_EQ(cycle->services().joints()[0].look.resetting, 0);
  for (int i = 0; i < 1000; ++i) {
    steps(1);
    ASSERT_FALSE(powered());
  }
  EXPECT_EQ(cycle->phase(), RunPhase::kFaulted);
  EXPECT_EQ(cycle->fault_log().latched(), 1U) << "the run's stop is";
  cycle->inbox().reset_faults();
  until(RunPhase::kHeld);
  EXPECT_TRUE(powered());
}

/// Its fault only warned: the run goes on, and the drive comes back where the joint is.
TEST_F(Swing, IsHeldWhereItIsWhenItsDriveIsResetAndNobodyHasIt) {
  begin(StopCategory::kWarn);
  inject(FaultKind::kEncoderUnplug, 5);
  come_to_rest();
  const double rest = cycle->state().position_rad()[0];
  ASSERT_TRUE(cycle->services().switch_controllers({"sine"}, {}, RunServices::Patience{0}));
  steps(1);
  ASSERT_TRUE(cycle->services().reset_joint("swing", RunServices::Patience{0}));
  int taken = 0;
  for (; taken < 3000 && !powered(); ++taken) steps(1);
  EXPECT_LT(taken, 1000);
  steps(1000);
  EXPECT_EQ(cycle->phase(), RunPhase::kRunning);
  EXPECT_NEAR(cycle->command().position_rad()[0], rest, 1e-3);
  EXPECT_NEAR(cycle->state().position_rad()[0], rest, 0.02) << "it moves by its weight only";
  EXPECT_EQ(cycle->fault_log().latched(), 0U);
  inject(FaultKind::kEncoderUnplug, 5);
  steps(50);
  EXPECT_EQ(cycle->fault_log().latched(), 1U) << "the next fault is noted, too";
}

/// Nothing takes a second attempt by itself when the cause goes away later.
TEST_F(Swing, StaysInFaultWhenTheCauseOutlastsTheReset) {
  begin(StopCategory::kCategory1, AfterReset::kHold);
  inject(FaultKind::kEncoderUnplug, 6000);
  steps(500);
  ASSERT_TRUE(cycle->services().reset_joint("swing", RunServices::Patience{0}));
  steps(10);
  EXPECT_EQ(cycle->services().joints()[0].look.resetting, 1);
  steps(4000);
  EXPECT_EQ(cycle->services().joints()[0].look.resetting, 0);
  steps(3000);
  EXPECT_NE(cycle->state().fault()[0], 0U);
  EXPECT_EQ(cycle->phase(), RunPhase::kFaulted);
}

/// It hangs at 0, where it may not go.
TEST_F(Swing, IsHeldBeyondItsLimitAndLedBackSlowly) {
  min_position_rad = 0.3;
  begin(StopCategory::kCategory0, AfterReset::kHold);
  cycle->inbox().emergency_stop(StopCategory::kCategory0);
  come_to_rest();
  const double rest = cycle->state().position_rad()[0];
  ASSERT_LT(rest, 0.1);
  cycle->inbox().reset_faults();
  until(RunPhase::kHeld);
  steps(1000);
  EXPECT_NEAR(cycle->state().position_rad()[0], rest, 1e-3) << "nothing pulls it in";
  ASSERT_TRUE(cycle->services().recover("swing", RunServices::Patience{0}));
  double fastest = 0.0;
  int taken = 0;
  for (; taken < 3000 && cycle->command().position_rad()[0] < 0.3; ++taken) {
    steps(1);
    fastest = std::max(fastest, std::abs(cycle->state().velocity_rad_s()[0]));
  }
  EXPECT_LT(fastest, 1.5 * 0.05 * 5.0) << "a twentieth of its velocity, and what the spring adds";
  EXPECT_GT(taken, 1000);
  steps(1000);
  EXPECT_NEAR(cycle->state().position_rad()[0], 0.3, 5e-3);
  EXPECT_EQ(cycle->phase(), RunPhase::kHeld);
  EXPECT_EQ(cycle->fault_log().latched(), 0U);
}

// A joint that swings when it is enabled again is caught where it is, not where it was.
TEST_F(Swing, IsCaughtInMotionWhereItIs) {
  begin(StopCategory::kCategory0);
  inject(FaultKind::kEncoderUnplug, 5);
  steps(60);
  cycle->inbox().reset_faults();
  until(RunPhase::kSettling);
  const double way = std::abs(cycle->state().velocity_rad_s()[0]) * 2e-3 + 1e-4;
  EXPECT_NEAR(cycle->command().position_rad()[0], cycle->state().position_rad()[0], way);
}

TEST_F(Swing, IsStoppedByItsBoardsEmergencyInputAndNotResetWhileThatIsActive) {
  for (const StopCategory category : {StopCategory::kCategory0, StopCategory::kCategory1}) {
    SCOPED_TRACE(to_string(category));
    begin(category);
    inject(FaultKind::kEmergencyStop, 3000);
    steps(1);
    EXPECT_EQ(cycle->phase(), RunPhase::kFaulted) << "in the cycle of the input";
    EXPECT_EQ(cycle->faults().at(0).text, "the emergency stop input of its board is active");
    EXPECT_EQ(cycle->faults().at(0).category, category);
    EXPECT_EQ(cycle->faults().at(0).board, "board");
    steps(1400);
    EXPECT_FALSE(powered());
    cycle->inbox().reset_faults();
    until(RunPhase::kResetting);
    until(RunPhase::kFaulted);
    EXPECT_EQ(cycle->progress().failed_resets.load(), 1U);
    EXPECT_FALSE(powered());
    steps(2000);  // the input is inactive again
    EXPECT_EQ(cycle->phase(), RunPhase::kFaulted) << "latched";
    cycle->inbox().reset_faults();
    until(RunPhase::kResetting);
    until(RunPhase::kRunning);
    EXPECT_FALSE(cycle->faults().at(0).latched);
  }
}

TEST_F(Swing, LosesItsTorqueACycleAfterAnEmergencyStopOfCategory0) {
  begin(StopCategory::kCategory1);
  cycle->inbox().emergency_stop(StopCategory::kCategory0);
  steps(1);
  EXPECT_TRUE(powered()) << "the command goes out with this cycle";
  steps(1);
  EXPECT_FALSE(powered()) << "and takes effect at the next SYNC";
}

TEST_F(Swing, BrakesACycleAfterAnEmergencyStopOfCategory1) {
  begin(StopCategory::kCategory1);
  cycle->inbox().emergency_stop(StopCategory::kCategory1);
  steps(2);
  EXPECT_EQ(backend->robot().board(0).axis(0).machine().motion(), canopen::DriveMotion::kQuickStop);
  steps(1100);
  EXPECT_FALSE(powered());
}

}  // namespace
}  // namespace tandem::runtime
