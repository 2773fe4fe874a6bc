// A loop around the swing: a pendulum that its joint has to carry, its board, its spring.
#pragma once

#include "hal/sim/sim_robot.hpp"
#include "tests/runtime/loop_run.hpp"
#include "tests/sim/swing_robot.hpp"

namespace tandem::runtime::test {

struct SwingLoop : LoopRun {
  explicit SwingLoop(hal::RobotConfig config = tandem::test::swing_robot())
      : LoopRun(std::move(config), tandem::test::swing_kernels(2)) {}

  /// After the controllers are added: it hangs from its hoist at 0.5 rad, which lets it go.
  void begin(const CycleConfig& config,
             const sim::SimRobotConfig& sim = {.posture = "up", .release_ns = 100'000'000}) {
    auto made = sim::SimRobot::create(robot, kernels, sim);
    ASSERT_TRUE(made) << made.error().to_string();
    backend = std::move(*made);
    truth = &backend->truth();
    LoopRun::begin(*backend, config);
  }
  void run_to(RunPhase phase) {
    (void)until(phase, 60'000);
    ASSERT_EQ(cycle->phase(), phase) << backend->status_text();
  }
  /// The largest change of the spring's torque in a cycle, over `count` cycles.
  double torque_step(int count) {
    double largest = 0.0;
    for (int i = 0; i < count; ++i) {
      const double before = cycle->state().torque_Nm()[0];
      EXPECT_TRUE(cycle->step());
      largest = std::max(largest, std::abs(cycle->state().torque_Nm()[0] - before));
    }
    return largest;
  }

  std::unique_ptr<sim::SimRobot> backend;
};

}  // namespace tandem::runtime::test
