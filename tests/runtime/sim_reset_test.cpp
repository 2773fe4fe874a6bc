// Emergency stops through the whole chain, of a joint in motion under gravity.
#include "hal/sim/sim_robot.hpp"
#include "rt/clock.hpp"
#include "runtime/robot_cycle.hpp"
#include "tests/runtime/test_controllers.hpp"
#include "tests/sim/swing_robot.hpp"

namespace tandem::runtime {
namespace {

using hal::StopCategory;

/// The swing on a sine of 0.2 rad, whose faults wait for a reset.
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
  void until(RunPhase phase) {
    for (int i = 0; i < 6000 && cycle->phase() != phase; ++i) (void)cycle->step();
    EXPECT_EQ(cycle->phase(), phase) << backend->status_text();
  }
  [[nodiscard]] bool powered() const {
    return backend->robot().board(0).axis(0).machine().motion() != canopen::DriveMotion::kNone;
  }

  hal::RobotConfig robot;
  std::unique_ptr<sim::SimRobot> backend;
  std::unique_ptr<ControllerHost> host;
  rt::WallClock clock;
  std::unique_ptr<RobotCycle> cycle;
};

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
