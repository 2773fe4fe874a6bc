#include "runtime/robot_cycle.hpp"

#include <thread>

#include "log/log_file.hpp"
#include "tests/log/scratch_folder.hpp"
#include "tests/rt/fake_clock.hpp"
#include "tests/runtime/loop_run.hpp"
#include "tests/support/rt_trap.hpp"

// Linked with the real-time trap: a cycle that allocates, locks or blocks fails its test.

namespace tandem::runtime {
namespace {

using test::FirstOrderRobot;
using test::Sine;

constexpr std::uint64_t kRunning = 500;

/// A run of the fake robot's configuration on first-order joints; one controller moves joint 0.
struct TestRun : test::JointRun {
  explicit TestRun(CycleConfig config = {}, log::Recorder* its_recorder = nullptr,
                   rt::Clock* other_clock = nullptr,
                   hal::RobotConfig its_robot = hal::test::fake_robot())
      : JointRun(std::move(its_robot)) {
    if (config.running_cycles == 0) config.running_cycles = kRunning;
    if (other_clock != nullptr) clock = other_clock;
    recorder = its_recorder;
    truth = &backend.truth;
    begin(config);
  }

  Sine* controller = add_sine();
};

TEST(RobotCycle, GoesThroughBringUpRunningAndShutDown) {
  TestRun run;
  run.steps(19);
  EXPECT_EQ(run.cycle->phase(), RunPhase::kBringUp);
  EXPECT_EQ(run.controller->updates, 0);
  run.steps(1);
  EXPECT_EQ(run.cycle->phase(), RunPhase::kRunning);
  run.steps(kRunning - 1);
  EXPECT_EQ(run.cycle->phase(), RunPhase::kRunning);
  run.steps(1);
  EXPECT_EQ(run.cycle->phase(), RunPhase::kShutDown);
  run.cycle->run();
  EXPECT_EQ(run.cycle->phase(), RunPhase::kDone);
  EXPECT_EQ(run.controller->updates, static_cast<int>(kRunning));
  EXPECT_EQ(run.controller->stops, 1);
  EXPECT_EQ(run.cycle->running_cycles(), kRunning);
  EXPECT_EQ(run.cycle->loop().cycles, 19U + kRunning + 3U);
  EXPECT_TRUE(run.cycle->faults().empty());
  EXPECT_FALSE(run.cycle->step());
}

TEST(RobotCycle, HoldsEveryJointUntilTheRobotHasSettled) {
  TestRun run({.settle_cycles = 30});
  run.steps(20);
  EXPECT_EQ(run.cycle->phase(), RunPhase::kSettling);
  const double held = run.cycle->command().position_rad()[0];
  for (int i = 0; i < 29; ++i) {
    run.steps(1);
    EXPECT_EQ(run.cycle->phase(), RunPhase::kSettling);
    EXPECT_EQ(run.cycle->command().position_rad()[0], held);
    EXPECT_EQ(run.cycle->command().mode()[0],
              static_cast<std::int8_t>(hal::ControlMode::kPosition));
  }
  EXPECT_EQ(run.controller->updates, 0);
  run.steps(1);
  EXPECT_EQ(run.cycle->phase(), RunPhase::kRunning);
  EXPECT_EQ(run.controller->updates, 1);
}

/// The sine moves joint 0; this writes to all three, and has joint 1.
void run_with_stray(TestRun& run) {
  EXPECT_TRUE(run.host->add("stray", std::make_unique<test::Stray>(1, false), test::parameters()));
  run.steps(30);
  EXPECT_NE(run.cycle->command().position_rad()[0], 0.07);
  EXPECT_EQ(run.cycle->command().mode()[2], static_cast<std::int8_t>(hal::ControlMode::kPosition));
  ASSERT_FALSE(run.cycle->faults().empty());
  const FaultReport first = run.cycle->faults()[0];
  EXPECT_EQ(first.cycle, 19U) << "the first in which controllers run";
  EXPECT_EQ(first.joint, run.robot.joints[0].name);
  EXPECT_EQ(first.text,
            "the controller 'stray' wrote to this joint, its mode or its gains without a claim, or "
            "what the joint cannot do: taken back");
}

TEST(RobotCycle, WhatAControllerHasNotClaimedIsTakenBackAndTold) {
  TestRun run;
  run_with_stray(run);
  EXPECT_EQ(run.cycle->phase(), RunPhase::kRunning);
  EXPECT_EQ(run.cycle->faults().size(), 3U) << "once of each joint";
  EXPECT_EQ(run.cycle->faults()[0].category, hal::StopCategory::kWarn);
}

TEST(RobotCycle, WhatAControllerHasNotClaimedStopsTheRobotWhereTheExperimentSaysSo) {
  TestRun run({.after_stop = AfterStop::kWait, .on_stray = hal::StopCategory::kCategory1});
  run_with_stray(run);
  EXPECT_EQ(run.cycle->phase(), RunPhase::kFaulted);
  EXPECT_EQ(run.cycle->faults().size(), 1U);
}

TEST(RobotCycle, AFaultWhileSettlingIsTheJointsStopCategory) {
  TestRun run({.settle_cycles = 30});
  run.steps(25);
  run.backend.faulted_joint = 0;
  run.cycle->run();
  EXPECT_EQ(run.controller->updates, 0);
  ASSERT_EQ(run.cycle->faults().size(), 1U);
}

TEST(RobotCycle, TellsItsProgressToAnotherThread) {
  TestRun run;
  std::uint64_t last = 0;
  std::thread watcher([&] {
    const Progress& progress = run.cycle->progress();
    while (progress.phase.load() != RunPhase::kDone) {
      const std::uint64_t now = progress.running_cycles.load();
      EXPECT_GE(now, last);
      last = now;
      std::this_thread::yield();
    }
  });
  run.cycle->run();
  watcher.join();
  EXPECT_EQ(run.cycle->progress().total_cycles.load(), kRunning);
  EXPECT_EQ(run.cycle->progress().running_cycles.load(), kRunning);
}

TEST(RobotCycle, IsUnderTheTrapWithEverythingThatItCalls) {
  if (!tandem::test::rt_trap_active()) GTEST_SKIP() << "the sanitizer watches instead";
  TestRun run;
  run.steps(100);
  run.controller->allocates = true;
  run.steps(1);
  const auto caught = tandem::test::take_rt_violations();
  ASSERT_FALSE(caught.empty());
  EXPECT_EQ(caught[0].call, "malloc");
}

TEST(RobotCycle, MeasuresHowWellEachJointFollows) {
  TestRun run;
  run.cycle->run();
  const auto tracking = run.cycle->statistics().tracking();
  // A first-order lag of T = period / share follows a sine of w with the error A w T, nearly.
  const double lag = 0.2 * 6.283 * 0.001 / FirstOrderRobot::kShare;
  EXPECT_NEAR(tracking[0].max_rad, lag, 0.05 * lag);
  EXPECT_NEAR(tracking[0].rms_rad, lag / std::sqrt(2.0), 0.15 * lag);
  EXPECT_EQ(tracking[1].max_rad, 0.0);
}

/// Claims a joint for torque control, and leaves its position reference alone.
class Silent : public Controller {
 public:
  explicit Silent(std::size_t joint) : joint_(joint) {}
  Status configure(ControllerSetup& setup) override {
    setup.claim(joint_, hal::ControlMode::kTorque);
    return {};
  }
  void start(const hal::CycleTime&, const hal::StateImage&, hal::CommandImage&) noexcept override {}
  Code update(const hal::CycleTime&, const hal::StateImage&,
              hal::CommandImage& command) noexcept override {
    command.torque_Nm()[joint_] = 0.5;
    return Code::kOk;
  }
  void archive(Archive&) override {}

 private:
  std::size_t joint_;
};

/// It was lost: the tracking error of a controller with a loop of its own was 0.
TEST(RobotCycle, KeepsThePositionThatAControllerWantsInTorqueMode) {
  for (const std::uint32_t delay : {0U, 3U}) {
    test::JointRun run;
    run.add("sine", std::make_shared<Sine>(std::vector<std::size_t>{0}, hal::ControlMode::kTorque));
    run.add("silent", std::make_shared<Silent>(1));
    struct Seen final : hal::CycleObserver {
      void take(const hal::CycleView& view) noexcept override {
        if (view.phase != RunPhase::kRunning) return;
        shown_rad = std::max(shown_rad, view.command.position_rad()[0] - 0.1);
        const bool torque =
            view.command.mode()[1] == static_cast<std::int8_t>(hal::ControlMode::kTorque);
        silent = silent && std::isnan(view.command.position_rad()[1]) == torque;
      }
      double shown_rad = 0.0;
      bool silent = true;
    } seen;
    run.observer = &seen;
    run.begin({.running_cycles = kRunning, .delay_cycles = delay});
    run.until(RunPhase::kRunning);
    run.steps(250);
    RobotCycle& cycle = *run.cycle;
    EXPECT_EQ(cycle.command().position_rad()[0], cycle.state().position_rad()[0]) << "is sent";
    cycle.run();
    const auto tracking = cycle.statistics().tracking();
    EXPECT_NEAR(tracking[0].max_rad, 0.2, 1e-3) << "it does not move, and the sine does";
    EXPECT_NEAR(seen.shown_rad, 0.2, 1e-3);
    EXPECT_EQ(tracking[1].cycles, delay) << "until then it is held by position";
    EXPECT_TRUE(seen.silent);
  }
}

TEST(RobotCycle, StopsInOrderOnRequest) {
  TestRun run;
  run.steps(100);
  run.cycle->inbox().end_run();
  run.cycle->run();
  EXPECT_EQ(run.controller->stops, 1);
  EXPECT_LT(run.cycle->running_cycles(), kRunning);
  EXPECT_TRUE(run.cycle->faults().empty());
}

TEST(RobotCycle, EndsWhenEveryControllerIsDone) {
  TestRun run;
  run.steps(100);
  run.controller->answer = Code::kStopped;
  run.cycle->run();
  EXPECT_TRUE(run.cycle->faults().empty());
  EXPECT_EQ(run.cycle->loop().cycles, 100U + 3U);
}

TEST(RobotCycle, ShutsDownWhenADriveOfCategory1Faults) {
  TestRun run;
  run.steps(100);
  run.backend.faulted_joint = 1;
  run.backend.latch_on_fault = true;
  run.steps(1);
  EXPECT_EQ(run.cycle->phase(), RunPhase::kShutDown);
  run.cycle->run();
  const auto faults = run.cycle->faults();
  ASSERT_EQ(faults.size(), 1U);
  EXPECT_EQ(faults[0].joint, "elbow");
  EXPECT_EQ(faults[0].text, "the drive reports error 0x7310");
  EXPECT_DOUBLE_EQ(faults[0].time_s, 0.1);
  EXPECT_EQ(run.backend.idle_writes, 0U);
}

hal::RobotConfig with_category(hal::StopCategory category) {
  hal::RobotConfig robot = hal::test::fake_robot();
  robot.joints[1].on_fault = category;
  return robot;
}

TEST(RobotCycle, TakesTheTorqueAwayAtOnceInCategory0) {
  TestRun run({}, nullptr, nullptr, with_category(hal::StopCategory::kCategory0));
  run.steps(100);
  run.backend.faulted_joint = 1;
  run.steps(1);
  for (const std::int8_t mode : run.cycle->command().mode()) EXPECT_EQ(mode, 0);
}

TEST(RobotCycle, HoldsEveryJointWhenTheFaultyOneAsksForIt) {
  TestRun run({}, nullptr, nullptr, with_category(hal::StopCategory::kHold));
  run.steps(100);
  run.backend.faulted_joint = 1;
  run.backend.latch_on_fault = true;
  run.steps(1);
  EXPECT_EQ(run.cycle->phase(), RunPhase::kFaulted);
  run.steps(300);  // it brakes
  const double held = run.cycle->command().position_rad()[0];
  run.steps(50);
  EXPECT_EQ(run.cycle->command().position_rad()[0], held);
  EXPECT_EQ(run.controller->stops, 1);
  run.cycle->run();
  EXPECT_EQ(run.cycle->loop().cycles, 19U + kRunning + 3U);  // the run's time goes on
  EXPECT_EQ(run.controller->stops, 1);
  EXPECT_EQ(run.cycle->faults().size(), 1U);
}

TEST(RobotCycle, OnlyTellsOfAFaultWhoseJointWarns) {
  TestRun run({}, nullptr, nullptr, with_category(hal::StopCategory::kWarn));
  run.steps(100);
  run.backend.faulted_joint = 1;
  run.cycle->run();
  EXPECT_EQ(run.cycle->running_cycles(), kRunning);
  EXPECT_EQ(run.cycle->faults().size(), 1U);
}

TEST(RobotCycle, NoticesAJointWhoseFeedbackStops) {
  TestRun run;
  run.steps(100);
  run.backend.lost_joint = 2;
  run.steps(10);
  EXPECT_EQ(run.cycle->phase(), RunPhase::kRunning);
  run.steps(1);
  EXPECT_EQ(run.cycle->phase(), RunPhase::kShutDown);
  EXPECT_EQ(run.cycle->faults().at(0).joint, "wrist");
  EXPECT_EQ(run.cycle->faults().at(0).text, "no feedback for 11 cycles");
}

TEST(RobotCycle, TellsOnceOfASensorThatIsLostAndGoesOn) {
  TestRun run;
  run.steps(100);
  run.backend.lost_sensor = 1;
  run.cycle->run();
  EXPECT_EQ(run.cycle->running_cycles(), kRunning);
  ASSERT_EQ(run.cycle->faults().size(), 1U);
  EXPECT_EQ(run.cycle->faults()[0].joint, "imu");
}

TEST(RobotCycle, StopsOnACommandThatIsNotFiniteAndNeverSendsIt) {
  TestRun run;
  run.steps(100);
  run.controller->not_finite = true;
  run.steps(1);
  EXPECT_TRUE(std::isfinite(run.cycle->command().position_rad()[0]));
  EXPECT_EQ(run.cycle->phase(), RunPhase::kShutDown);
  EXPECT_EQ(run.cycle->faults().at(0).joint, "shoulder");
}

TEST(RobotCycle, NamesTheControllerThatGivesUp) {
  TestRun run;
  run.steps(100);
  run.controller->answer = Code::kOutOfRange;
  run.cycle->run();
  EXPECT_EQ(run.cycle->faults().at(0).joint, "sine");
  EXPECT_EQ(run.cycle->faults().at(0).text, "the controller gave up: OutOfRange");
}

TEST(RobotCycle, EndsAtOnceWhenTheSimulationDiverges) {
  TestRun run;
  run.steps(100);
  run.backend.answer = Code::kDiverged;
  EXPECT_FALSE(run.cycle->step());
  ASSERT_EQ(run.cycle->faults().size(), 1U);
  EXPECT_EQ(run.cycle->faults()[0].text, "the bus is cut");  // what the backend says
}

TEST(RobotCycle, GivesUpOnABringUpThatTakesTooLongAndSaysWhatItWaitsFor) {
  TestRun run({.bring_up_cycles = 50});
  run.backend.bring_up_cycles = 1000;
  run.cycle->run();
  EXPECT_EQ(run.controller->updates, 0);
  EXPECT_EQ(run.cycle->faults().at(0).text,
            "the drives were not enabled in time: elbow (node 2): waiting for 6041");
}

TEST(RobotCycle, GivesUpOnAShutDownThatNeverEnds) {
  TestRun run({.running_cycles = 10, .shut_down_cycles = 30});
  run.backend.shut_down_cycles = ~std::uint64_t{0};
  run.cycle->run();
  EXPECT_EQ(run.cycle->loop().cycles, 19U + 10U + 31U);
}

TEST(RobotCycle, RepeatsTheLastCommandAfterALateCycleWhenThePolicyIsHold) {
  rt::FakeClock clock;
  TestRun run({.loop = {.pacing = rt::Pacing::kWallClock, .on_overrun = rt::OverrunPolicy::kHold}},
              nullptr, &clock);
  run.steps(100);
  const int updates = run.controller->updates;
  const double sent = run.cycle->command().position_rad()[0];
  clock.now += 5'300'000;
  run.steps(1);
  EXPECT_EQ(run.controller->updates, updates);
  EXPECT_EQ(run.cycle->command().position_rad()[0], sent);
  EXPECT_EQ(run.cycle->loop().overruns, 1U);
  run.steps(1);
  EXPECT_EQ(run.controller->updates, updates + 1);
}

TEST(RobotCycle, StopsWhenTooManyCyclesAreLate) {
  rt::FakeClock clock;
  TestRun run({.loop = {.pacing = rt::Pacing::kWallClock,
                        .on_overrun = rt::OverrunPolicy::kStop,
                        .stop_late = 2,
                        .stop_window = 10}},
              nullptr, &clock);
  run.steps(100);
  clock.now += 1'500'000;
  run.steps(1);
  EXPECT_EQ(run.cycle->phase(), RunPhase::kRunning);
  clock.now += 1'500'000;
  run.steps(1);
  EXPECT_EQ(run.cycle->phase(), RunPhase::kShutDown);
  EXPECT_EQ(run.cycle->faults().at(0).text, "2 of the last 10 cycles were late");
}

/// The bytes of state, command and truth over `count` cycles.
std::vector<std::byte> bytes_of(TestRun& run, int count) {
  std::vector<std::byte> all;
  for (int i = 0; i < count; ++i) {
    run.cycle->step();
    for (const auto& bytes : {run.cycle->state().bytes(), run.cycle->command().bytes(),
                              std::as_const(run.backend.truth).bytes()}) {
      all.insert(all.end(), bytes.begin(), bytes.end());
    }
  }
  return all;
}

TEST(RobotCycle, GivesTheSameBytesAgainAfterARestore) {
  TestRun run;
  run.steps(123);
  const auto snapshot = run.cycle->save();
  ASSERT_TRUE(snapshot);
  const auto first = bytes_of(run, 250);
  ASSERT_TRUE(run.cycle->restore(*snapshot));
  const auto second = bytes_of(run, 250);
  EXPECT_TRUE(first == second);
  EXPECT_EQ(run.cycle->save()->size(), snapshot->size());
}

TEST(RobotCycle, ContinuesASnapshotInAnotherProcessOfTheSameConfiguration) {
  TestRun one;
  TestRun other;
  one.steps(123);
  const auto snapshot = one.cycle->save();
  ASSERT_TRUE(snapshot);
  ASSERT_TRUE(other.cycle->restore(*snapshot));
  EXPECT_TRUE(bytes_of(one, 100) == bytes_of(other, 100));
  one.cycle->run();
  other.cycle->run();
  EXPECT_EQ(one.cycle->statistics().tracking()[0].rms_rad,
            other.cycle->statistics().tracking()[0].rms_rad);
}

TEST(RobotCycle, RefusesASnapshotOfAnotherRobotOrOfARealOne) {
  TestRun run;
  auto snapshot = run.cycle->save();
  ASSERT_TRUE(snapshot);
  snapshot->pop_back();
  EXPECT_FALSE(run.cycle->restore(*snapshot));
  run.backend.can_rewind = false;
  EXPECT_FALSE(run.cycle->save());
}

/// Runs and records; the loop at `rate`, beside a thread that takes CPU time when `loaded`.
log::RecordingResult record(const std::string& path, double rate, bool loaded = false) {
  auto recorder = log::Recorder::open(path, {.joints = {"shoulder", "elbow", "wrist"}}, {});
  EXPECT_TRUE(recorder);
  std::atomic<bool> done{false};
  std::thread load([&] {
    double sum = 0.0;
    while (loaded && !done.load()) sum += std::sin(sum + 1.0);
  });
  TestRun run({.loop = {.pacing = rt::Pacing::kSimulated, .rate = rate}}, recorder->get());
  run.cycle->run();
  done = true;
  load.join();
  EXPECT_EQ(run.cycle->loop().cycles, 19U + kRunning + 3U);
  return (*recorder)->close();
}

TEST(RobotCycle, LogsEveryCycleAndEvent) {
  const log::ScratchFolder folder;
  const auto result = record(folder / "a.mcap", 0.0);
  EXPECT_EQ(result.dropped, 0U);
  const auto log = log::LogFile::open(folder / "a.mcap");
  ASSERT_TRUE(log);
  for (const char* topic : {"/tandem/state", "/tandem/command", "/tandem/truth"}) {
    ASSERT_NE(log->find(topic), nullptr) << topic;
    EXPECT_EQ(log->find(topic)->messages, 19U + kRunning + 3U) << topic;
  }
  std::vector<std::string> texts;
  const auto events = log->events();
  ASSERT_TRUE(events);
  for (const auto& event : *events) texts.push_back(event.text);
  EXPECT_EQ(texts, (std::vector<std::string>{"started", "bring-up done", "controllers done",
                                             "shut down"}));
}

TEST(RobotCycle, LogsTheSameDataWhateverTheRateAndTheLoad) {
  const log::ScratchFolder folder;
  const std::string free = record(folder / "free.mcap", 0.0).data_sha256;
  EXPECT_EQ(record(folder / "again.mcap", 0.0).data_sha256, free);
  EXPECT_EQ(record(folder / "five.mcap", 5.0).data_sha256, free);
  EXPECT_EQ(record(folder / "loaded.mcap", 0.0, true).data_sha256, free);
}

}  // namespace
}  // namespace tandem::runtime
