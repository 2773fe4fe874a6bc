// Stop, reset and emergency stop through the whole chain, of a joint in motion under gravity.
#include "hal/sim/sim_robot.hpp"
#include "rt/clock.hpp"
#include "runtime/robot_cycle.hpp"
#include "tests/runtime/test_controllers.hpp"
#include "tests/sim/swing_robot.hpp"

namespace tandem::runtime {
namespace {

using hal::FaultKind;
using hal::StopCategory;

/// The most that gravity asks of the joint [Nm], and of the motor's voltage for it [V]: R / (N K).
constexpr double kGravity_Nm = 9.81 * 2.0 * 0.5;
constexpr double kGravity_V = kGravity_Nm * 0.664 / (100 * 0.041);

/// The swing on a sine of 0.5 rad, whose faults wait for a reset.
struct Swing : ::testing::Test {
  void begin(StopCategory on_fault) {
    robot = tandem::test::swing_robot();
    robot.joints[0].on_fault = on_fault;
    robot.emergency_stop = on_fault == StopCategory::kCategory0 ? on_fault
                                                                : StopCategory::kCategory1;
    auto made = sim::SimRobot::create(robot, tandem::test::swing_kernels(2),
                                      {.posture = "up", .release_ns = 100'000'000});
    ASSERT_TRUE(made) << made.error().to_string();
    backend = std::move(*made);
    host = std::make_unique<ControllerHost>(robot, tandem::test::swing_kernels(2), 1'000'000);
    ASSERT_TRUE(host->add("sine", std::make_unique<test::Sine>(std::vector<std::size_t>{0}),
                          test::parameters("amplitude_rad = 0.2")));
    cycle = std::make_unique<RobotCycle>(
        CycleParts{robot, *backend, *host, clock},
        CycleConfig{.settle_cycles = 200, .after_stop = AfterStop::kWait});
    until(RunPhase::kRunning);
    steps(1030);  // in full motion
  }
  void steps(int count) {
    for (int i = 0; i < count; ++i) EXPECT_TRUE(cycle->step());
  }
  int until(RunPhase phase, int most = 6000) {
    int taken = 0;
    while (taken < most && cycle->phase() != phase && cycle->step()) ++taken;
    EXPECT_EQ(cycle->phase(), phase) << backend->status_text();
    return taken;
  }
  void inject(FaultKind kind, int cycles) {
    sim::Fault fault;
    fault.kind = kind;
    (kind == FaultKind::kEncoderUnplug ? fault.joint : fault.board) = 0;
    fault.duration_ns = cycles * 1'000'000;
    ASSERT_EQ(backend->robot().inject(fault), Code::kOk);
  }
  /// The largest change of the motor's voltage and the spring's torque in a cycle, until `phase`
  /// and `more` cycles of it.
  void watch_steps(RunPhase phase, int more) {
    double volts = cycle->state().voltage_V()[0];
    double torque = cycle->state().torque_Nm()[0];
    for (int left = more; left > 0;) {
      ASSERT_TRUE(cycle->step());
      if (cycle->phase() == phase) --left;
      const double volts_now = cycle->state().voltage_V()[0];
      const double torque_now = cycle->state().torque_Nm()[0];
      volts_step = std::max(volts_step, std::abs(volts_now - volts));
      torque_step = std::max(torque_step, std::abs(torque_now - torque));
      volts = volts_now;
      torque = torque_now;
    }
  }
  [[nodiscard]] bool powered() const {
    return backend->robot().board(0).axis(0).machine().motion() != canopen::DriveMotion::kNone;
  }

  hal::RobotConfig robot;
  std::unique_ptr<sim::SimRobot> backend;
  std::unique_ptr<ControllerHost> host;
  rt::WallClock clock;
  std::unique_ptr<RobotCycle> cycle;
  double volts_step = 0.0, torque_step = 0.0;
};

TEST_F(Swing, GoesOnWithoutABumpAfterTheResetOfAFaultOfAnyCategory) {
  for (const StopCategory category : {StopCategory::kCategory0, StopCategory::kCategory1,
                                      StopCategory::kHold, StopCategory::kWarn}) {
    SCOPED_TRACE(to_string(category));
    begin(category);
    inject(FaultKind::kEncoderUnplug, 5);
    steps(category == StopCategory::kCategory0 ? 60 : 1500);  // the former is falling
    ASSERT_EQ(cycle->fault_log().latched(), 1U);
    cycle->requests().reset_faults();
    volts_step = torque_step = 0.0;
    until(RunPhase::kResetting);
    watch_steps(RunPhase::kSettling, 150);
    std::printf("%s settle %g V %g Nm\n", to_string(category), volts_step, torque_step);
    until(RunPhase::kRunning);
    EXPECT_EQ(cycle->command().position_rad()[0], cycle->state().position_rad()[0]);
    volts_step = torque_step = 0.0;
    watch_steps(RunPhase::kRunning, 50);
    std::printf("%s run %g V %g Nm (%g V)\n", to_string(category), volts_step, torque_step, kGravity_V);
  }
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
    cycle->requests().reset_faults();
    until(RunPhase::kResetting);
    until(RunPhase::kFaulted);
    EXPECT_EQ(cycle->progress().failed_resets.load(), 1U);
    EXPECT_FALSE(powered());
    steps(2000);  // the input is inactive again
    EXPECT_EQ(cycle->phase(), RunPhase::kFaulted) << "latched";
    cycle->requests().reset_faults();
    until(RunPhase::kResetting);
    until(RunPhase::kRunning);
    EXPECT_FALSE(cycle->faults().at(0).latched);
  }
}

TEST_F(Swing, LosesItsTorqueACycleAfterAnEmergencyStopOfCategory0) {
  begin(StopCategory::kCategory1);
  cycle->requests().emergency_stop(StopCategory::kCategory0);
  steps(1);
  EXPECT_TRUE(powered()) << "the command goes out with this cycle";
  steps(1);
  EXPECT_FALSE(powered()) << "and takes effect at the next SYNC";
}

TEST_F(Swing, BrakesACycleAfterAnEmergencyStopOfCategory1) {
  begin(StopCategory::kCategory1);
  cycle->requests().emergency_stop(StopCategory::kCategory1);
  steps(2);
  EXPECT_EQ(backend->robot().board(0).axis(0).machine().motion(),
            canopen::DriveMotion::kQuickStop);
  steps(1100);
  EXPECT_FALSE(powered());
}

}  // namespace
}  // namespace tandem::runtime
