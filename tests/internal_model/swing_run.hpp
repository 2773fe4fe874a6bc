// The swing in its loop, and a second one beside it.
#pragma once

#include <gtest/gtest.h>

#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <utility>

#include "base/own_system_call.hpp"
#include "hal/forwarding_backend.hpp"
#include "internal_model/parallel_robot.hpp"
#include "internal_model/prediction_service.hpp"
#include "tests/rt/fake_clock.hpp"
#include "tests/runtime/loop_run.hpp"
#include "tests/sim/swing_robot.hpp"

namespace tandem::internal_model::test {

using runtime::RobotCycle;
using runtime::RunPhase;

constexpr std::int64_t kPeriod_ns = 1'000'000;

inline std::unique_ptr<sim::SimRobot> make_swing(const hal::RobotConfig& robot) {
  auto made = sim::SimRobot::create(robot, tandem::test::swing_kernels(2),
                                    {.posture = "up", .release_ns = 100'000'000});
  EXPECT_TRUE(made) << made.error().to_string();
  return std::move(*made);
}

/// A simulated robot that passes for one on the wall clock, or is slow.
class Dressed final : public hal::ForwardingBackend {
 public:
  Dressed(sim::SimRobot& robot, hal::Pace pace, std::chrono::microseconds slow = {})
      : ForwardingBackend(robot), pace_(pace), slow_(slow) {}
  hal::Pace pace() const noexcept override { return pace_; }
  Code read(const hal::CycleTime& time, hal::StateImage& state) noexcept override {
    if (slow_.count() > 0) {
      TANDEM_OWN_SYSTEM_CALL;
      std::this_thread::sleep_for(slow_);
    }
    return to().read(time, state);
  }
  bool archive(Archive& ar) override {
    return pace_ == hal::Pace::kSimulatedClock && to().archive(ar);
  }

 private:
  hal::Pace pace_;
  std::chrono::microseconds slow_;
};

struct RunOptions {
  std::uint64_t cycles = 600;
  double kp = 0.0;  ///< of the second robot's position loop; 0: as the first's
  bool beside = true;
  hal::Pace pace = hal::Pace::kSimulatedClock;
  std::chrono::microseconds slow{};  ///< the second robot takes so much longer a cycle
  log::Recorder* recorder = nullptr;
  hal::Predictor* predictor = nullptr;
  std::shared_ptr<Controller> controller = nullptr;  ///< null: a sine
  std::optional<hal::HomingConfig> homing = {};      ///< of its joint
};

/// The first swing on a sine, and the second.
struct SwingRun : runtime::test::LoopRun {
  explicit SwingRun(const RunOptions& options = {}, runtime::SnapshotPort* its_snapshots = nullptr)
      : LoopRun(swing(options), tandem::test::swing_kernels(2)),
        second_robot(robot),
        first(make_swing(robot)),
        dressed(*first, options.pace) {
    if (options.kp > 0.0) second_robot.gains.front().position.gains.kp = options.kp;
    host->predict_by(options.predictor);
    std::shared_ptr<Controller> moves = options.controller;
    if (moves == nullptr) {
      moves = std::make_shared<runtime::test::Sine>(std::vector<std::size_t>{0});
    }
    add("sine", moves, true, "amplitude_rad = 0.1");
    if (options.beside) {
      second = make_swing(second_robot);
      second_dressed.emplace(*second, hal::Pace::kSimulatedClock, options.slow);
      beside.emplace(ParallelParts{dressed, *second_dressed, &second->truth(), options.recorder},
                     robot.shape(), host->gains(), kPeriod_ns);
      beside->start();
    }
    config.loop.period_ns = kPeriod_ns;
    config.loop.pacing =
        options.pace == hal::Pace::kWallClock ? rt::Pacing::kWallClock : rt::Pacing::kSimulated;
    config.running_cycles = options.cycles;
    config.after_stop = runtime::AfterStop::kWait;
    clock = &no_time;
    recorder = options.recorder;
    truth = &first->truth();
    snapshots = its_snapshots;
    if (beside) {
      begin(beside->backend(), config);
    } else {
      begin(dressed, config);
    }
  }
  static hal::RobotConfig swing(const RunOptions& options) {
    hal::RobotConfig robot = tandem::test::swing_robot();
    robot.joints[0].homing = options.homing;
    return robot;
  }
  ~SwingRun() {
    if (beside) (void)beside->finish();
  }

  void run_to(RunPhase phase) {
    while (cycle->phase() != phase && cycle->step()) {
    }
    ASSERT_EQ(cycle->phase(), phase) << first->status_text();
  }

  hal::RobotConfig second_robot;
  std::unique_ptr<sim::SimRobot> first, second;
  Dressed dressed;
  std::optional<Dressed> second_dressed;
  rt::FakeClock no_time;  // whose sleeps take none
  runtime::CycleConfig config;
  std::optional<ParallelRobot> beside;
};

/// What a run is run ahead in.
struct SwingFork final : Fork {
  explicit SwingFork(const RunOptions& like = {}) : run(without_company(like)) {
    cycle = run.cycle.get();
    truth = &run.first->truth();
  }
  static RunOptions without_company(RunOptions like) {
    like.beside = false;
    like.pace = hal::Pace::kSimulatedClock;
    like.recorder = nullptr;
    like.controller = nullptr;
    static NoPredictor nobody;
    like.predictor = &nobody;
    return like;
  }
  [[nodiscard]] bool diverged() const override { return run.first->plant().diverged(); }

  SwingRun run;
};

}  // namespace tandem::internal_model::test
