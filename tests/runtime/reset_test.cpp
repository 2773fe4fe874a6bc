// Faults that wait, the reset that clears them, and the emergency stop, on first-order joints.
#include <csignal>

#include "log/log_file.hpp"
#include "rt/stop_signal.hpp"
#include "tests/log/scratch_folder.hpp"
#include "tests/rt/fake_clock.hpp"
#include "tests/runtime/loop_run.hpp"
#include "tests/support/rt_trap.hpp"

namespace tandem::runtime {
namespace {

using hal::StopCategory;

/// Past bring-up, with faults that wait for a reset.
struct Waiting : ::testing::Test, test::LoopRun {
  Waiting() : LoopRun(hal::test::fake_robot()) {
    start({.settle_cycles = 10,
           .after_stop = AfterStop::kWait,
           .after_reset = AfterReset::kContinue});
  }
  ~Waiting() override { (void)rt::take_emergency_stop(); }

  void start(CycleConfig config, StopCategory category = StopCategory::kCategory1,
             rt::Clock* other_clock = nullptr, log::Recorder* its_recorder = nullptr) {
    hal::RobotConfig config_of = hal::test::fake_robot();
    for (hal::JointConfig& joint : config_of.joints) joint.on_fault = category;
    of(std::move(config_of));
    backend = std::make_unique<test::FirstOrderRobot>(robot);
    backend->latch_on_fault = category != StopCategory::kWarn;
    controller = add_sine();
    if (config.running_cycles == 0) config.running_cycles = 1000;
    if (other_clock != nullptr) clock = other_clock;
    recorder = its_recorder;
    begin(*backend, config);
    steps(100);
    ASSERT_EQ(cycle->phase(), RunPhase::kRunning);
  }

  std::unique_ptr<test::FirstOrderRobot> backend;
  test::Sine* controller = nullptr;
};

TEST_F(Waiting, AFaultLatchesAndTheLoopGoesOn) {
  backend->faulted_joint = 1;
  steps(1);
  EXPECT_EQ(cycle->phase(), RunPhase::kFaulted);
  EXPECT_EQ(backend->latched, StopCategory::kCategory1);
  backend->faulted_joint = -1;
  steps(3000);  // longer than the run
  EXPECT_EQ(cycle->phase(), RunPhase::kFaulted);
  EXPECT_EQ(controller->stops, 1);
  EXPECT_EQ(cycle->progress().latched.load(), 1U);
  cycle->inbox().end_run();
  until(RunPhase::kDone);
  EXPECT_TRUE(cycle->faults().at(0).latched);
}

/// The same, where controllers wait for somebody to start them.
struct Held : Waiting {
  Held() {
    start({.settle_cycles = 10, .after_stop = AfterStop::kWait});
    auto other = std::make_unique<test::Sine>(std::vector<std::size_t>{1});
    second = other.get();
    EXPECT_TRUE(cycle->services().load("second", std::move(other),
                                       *TomlDocument::parse("", "x.toml"), kNoWait));
    steps(1);
  }
  void stop_and_reset() {
    backend->faulted_joint = 1;
    steps(50);
    cycle->inbox().reset_faults();
    steps(1);
    until(RunPhase::kHeld);
  }
  /// Whether the first controller runs within the next 100 cycles.
  [[nodiscard]] bool runs() {
    const int updates = controller->updates;
    steps(100);
    return controller->updates > updates;
  }

  static constexpr RunServices::Patience kNoWait{0};
  test::Sine* second = nullptr;
};

TEST_F(Held, AResetClearsAndHoldsAndNoMoreUntilControllersAreStarted) {
  const std::uint64_t ran = cycle->running_cycles();
  stop_and_reset();
  EXPECT_FALSE(cycle->faults().at(0).latched);
  EXPECT_EQ(host->shown().active, 0U);
  const std::vector<double> held(cycle->state().position_rad().begin(),
                                 cycle->state().position_rad().end());
  EXPECT_FALSE(runs());
  EXPECT_EQ(cycle->phase(), RunPhase::kHeld);
  for (std::size_t j = 0; j < held.size(); ++j) {
    EXPECT_DOUBLE_EQ(cycle->command().position_rad()[j], held[j]) << j;
  }
  EXPECT_EQ(cycle->running_cycles(), ran) << "the time in which it is held is not the run's";
  cycle->inbox().reset_faults();  // nothing is latched: no second way to go on
  EXPECT_FALSE(runs());

  ASSERT_TRUE(cycle->services().go_on(kNoWait));
  steps(1);
  EXPECT_EQ(cycle->phase(), RunPhase::kRunning);
  EXPECT_EQ(controller->starts, 2);
  EXPECT_EQ(second->starts, 0) << "it was not active before";
  until(RunPhase::kDone, 2000);
  EXPECT_EQ(cycle->running_cycles(), 1000U);
}

TEST_F(Held, AStartByNameStartsThatOneAlone) {
  stop_and_reset();
  ASSERT_TRUE(cycle->services().switch_controllers({}, {"second"}, kNoWait));
  EXPECT_FALSE(runs());
  EXPECT_EQ(second->starts, 1);
  EXPECT_EQ(cycle->phase(), RunPhase::kRunning);
  ASSERT_TRUE(cycle->services().switch_controllers({}, {"sine"}, kNoWait));
  EXPECT_EQ(controller->starts, 1);
  steps(1);
  EXPECT_EQ(controller->starts, 2);
}

TEST_F(Held, NobodyGoesOnWhileAFaultIsLatchedOrControllersRun) {
  const auto refused = [&] {
    ASSERT_TRUE(cycle->services().go_on(kNoWait)) << "the loop refuses it later";
    const int starts = controller->starts;
    steps(10);
    EXPECT_EQ(controller->starts, starts);
  };
  refused();
  EXPECT_EQ(cycle->phase(), RunPhase::kRunning);
  backend->faulted_joint = 1;
  steps(50);
  refused();
  EXPECT_EQ(cycle->phase(), RunPhase::kFaulted);
}

TEST_F(Held, ASecondFaultKeepsWhoIsHeldBack) {
  stop_and_reset();
  stop_and_reset();
  ASSERT_TRUE(cycle->services().go_on(kNoWait));
  EXPECT_TRUE(runs());
}

TEST_F(Held, AnUnloadedControllerDoesNotGoOnAndNeitherDoesTheNextInItsPlace) {
  stop_and_reset();
  ASSERT_TRUE(cycle->services().unload("sine", kNoWait));
  steps(1);
  auto another = std::make_unique<test::Sine>(std::vector<std::size_t>{0});
  const test::Sine* third = another.get();
  ASSERT_TRUE(cycle->services().load("third", std::move(another),
                                     *TomlDocument::parse("", "x.toml"), kNoWait));
  steps(1);
  ASSERT_TRUE(cycle->services().go_on(kNoWait));
  steps(10);
  EXPECT_EQ(third->starts, 0);
  EXPECT_EQ(cycle->phase(), RunPhase::kHeld);
}

TEST_F(Held, AJointThatOnlyWarnedIsNoReasonToMoveEither) {
  start({.settle_cycles = 10, .after_stop = AfterStop::kWait}, StopCategory::kWarn);
  backend->faulted_joint = 1;
  steps(10);
  cycle->inbox().reset_faults();
  steps(1);
  until(RunPhase::kHeld);
  EXPECT_EQ(controller->starts, 1);
}

TEST_F(Held, ASnapshotKnowsWhoIsHeldBack) {
  stop_and_reset();
  const auto saved = cycle->save();
  ASSERT_TRUE(saved) << saved.error().to_string();
  ASSERT_TRUE(cycle->services().go_on(kNoWait));
  EXPECT_TRUE(runs());
  ASSERT_TRUE(cycle->restore(*saved));
  EXPECT_EQ(cycle->phase(), RunPhase::kHeld);
  ASSERT_TRUE(cycle->services().go_on(kNoWait));
  EXPECT_TRUE(runs());
}

TEST_F(Waiting, AResetHoldsEveryJointThenStartsTheControllersAgain) {
  backend->faulted_joint = 1;
  steps(50);
  const int updates = controller->updates;
  cycle->inbox().reset_faults();
  steps(1);
  EXPECT_EQ(cycle->phase(), RunPhase::kResetting);
  EXPECT_EQ(until(RunPhase::kSettling), 5);
  EXPECT_EQ(until(RunPhase::kRunning), 10);
  EXPECT_EQ(controller->starts, 2);
  EXPECT_EQ(controller->updates, updates + 1);
  const FaultReport fault = cycle->faults().at(0);
  EXPECT_FALSE(fault.latched);
  EXPECT_DOUBLE_EQ(fault.time_s, 0.1);
  EXPECT_DOUBLE_EQ(fault.cleared_s, 0.155);
  EXPECT_EQ(fault.category, StopCategory::kCategory1);
  EXPECT_EQ(fault.joint, "elbow");
  EXPECT_EQ(fault.board, "board");
  until(RunPhase::kDone, 2000);
  EXPECT_EQ(cycle->running_cycles(), 1000U) << "the time in fault is not the run's";
}

TEST_F(Waiting, AResetWhoseCauseIsStillThereStaysLatchedAndIsTold) {
  backend->faulted_joint = 1;
  steps(10);
  backend->reset_clears = false;
  cycle->inbox().reset_faults();
  until(RunPhase::kResetting);
  steps(1);
  EXPECT_EQ(cycle->phase(), RunPhase::kFaulted);
  EXPECT_EQ(cycle->progress().failed_resets.load(), 1U);
  EXPECT_EQ(cycle->progress().resets.load(), 0U);
  EXPECT_TRUE(cycle->faults().at(0).latched);
  EXPECT_EQ(controller->starts, 1);
}

/// The reset has released the drives already, when a joint fails whose fault alone stops nothing.
TEST_F(Waiting, AFailedResetStopsTheDrivesAsBefore) {
  for (const StopCategory before :
       {StopCategory::kCategory0, StopCategory::kCategory1, StopCategory::kWarn}) {
    start({.settle_cycles = 10, .after_stop = AfterStop::kWait}, StopCategory::kWarn);
    if (before == StopCategory::kWarn) {
      backend->faulted_joint = 1;
    } else {
      cycle->inbox().emergency_stop(before);
    }
    steps(10);
    cycle->inbox().reset_faults();
    until(RunPhase::kResetting);
    ASSERT_EQ(backend->latched, StopCategory::kWarn);
    backend->latch_on_fault = true;
    backend->faulted_joint = 1;
    until(RunPhase::kFaulted);
    EXPECT_EQ(cycle->progress().failed_resets.load(), 1U);
    EXPECT_EQ(backend->latched, std::min(before, StopCategory::kHold))
        << "where nothing had stopped it, it is held";
  }
}

TEST_F(Waiting, AResetWhileNothingIsLatchedChangesNothing) {
  const int updates = controller->updates;
  cycle->inbox().reset_faults();
  steps(10);
  EXPECT_EQ(controller->updates, updates + 10);
  EXPECT_EQ(controller->starts, 1);
  EXPECT_EQ(cycle->progress().resets.load(), 0U);
}

TEST_F(Waiting, ASecondFaultIsNotedToo) {
  backend->faulted_joint = 1;
  steps(10);
  robot.joints[2].on_fault = StopCategory::kCategory0;
  backend->lost_joint = 2;
  steps(20);
  EXPECT_EQ(cycle->faults().size(), 2U);
  EXPECT_EQ(backend->latched, StopCategory::kCategory0) << "the harder one is carried out";
  for (const std::int8_t mode : cycle->command().mode()) EXPECT_EQ(mode, 0);
}

TEST_F(Waiting, AJointThatOnlyWarnsIsResetToo) {
  start({.settle_cycles = 10, .after_stop = AfterStop::kWait, .after_reset = AfterReset::kContinue},
        StopCategory::kWarn);
  backend->faulted_joint = 1;
  steps(10);
  EXPECT_EQ(cycle->phase(), RunPhase::kRunning);
  EXPECT_EQ(backend->stops, 0U);
  cycle->inbox().reset_faults();
  until(RunPhase::kResetting);
  until(RunPhase::kRunning);
  EXPECT_EQ(controller->starts, 2);
  EXPECT_FALSE(cycle->faults().at(0).latched);
}

TEST_F(Waiting, ASensorThatCameBackIsClearedWithoutStoppingAnything) {
  backend->lost_sensor = 0;
  steps(20);
  backend->lost_sensor = -1;
  steps(20);
  EXPECT_TRUE(cycle->faults().at(0).latched);
  cycle->inbox().reset_faults();
  steps(1);
  EXPECT_FALSE(cycle->faults().at(0).latched);
  EXPECT_EQ(cycle->phase(), RunPhase::kRunning);
  EXPECT_EQ(controller->starts, 1);
}

TEST_F(Waiting, WhatTheLoopFindsByItselfUsesTheSameStop) {
  controller->answer = Code::kOutOfRange;
  steps(1);
  EXPECT_EQ(cycle->phase(), RunPhase::kFaulted);
  EXPECT_EQ(backend->latched, StopCategory::kCategory1);
  controller->answer = Code::kOk;
  cycle->inbox().reset_faults();
  until(RunPhase::kRunning);

  controller->not_finite = true;
  until(RunPhase::kFaulted);
  controller->not_finite = false;
  cycle->inbox().reset_faults();
  until(RunPhase::kRunning);

  backend->answer = Code::kBusOff;
  until(RunPhase::kFaulted);
  backend->answer = Code::kOk;
  cycle->inbox().reset_faults();
  until(RunPhase::kRunning);
  EXPECT_EQ(cycle->faults().size(), 3U);
  EXPECT_EQ(controller->starts, 4);
}

TEST_F(Waiting, LateCyclesCountAnewAfterAReset) {
  rt::FakeClock slow;
  start({.loop = {.pacing = rt::Pacing::kWallClock,
                  .on_overrun = rt::OverrunPolicy::kStop,
                  .stop_late = 2,
                  .stop_window = 64},
         .after_stop = AfterStop::kWait,
         .after_reset = AfterReset::kContinue},
        StopCategory::kCategory1, &slow);
  for (int i = 0; i < 2; ++i) {
    slow.now += 1'500'000;
    steps(1);
  }
  EXPECT_EQ(cycle->phase(), RunPhase::kFaulted);
  cycle->inbox().reset_faults();
  until(RunPhase::kRunning);
  slow.now += 1'500'000;
  steps(1);
  EXPECT_EQ(cycle->phase(), RunPhase::kRunning);
}

TEST_F(Waiting, AnEmergencyStopOnRequestStopsInTheNextCycle) {
  for (const StopCategory category : {StopCategory::kCategory0, StopCategory::kCategory1}) {
    start({.after_stop = AfterStop::kWait, .after_reset = AfterReset::kContinue});
    cycle->inbox().emergency_stop(category);
    steps(1);
    EXPECT_EQ(cycle->phase(), RunPhase::kFaulted);
    EXPECT_EQ(backend->latched, category);
    EXPECT_EQ(cycle->faults().at(0).text, "emergency stop on request");
    EXPECT_EQ(cycle->faults().at(0).category, category);
    cycle->inbox().reset_faults();
    until(RunPhase::kRunning);
  }
}

TEST_F(Waiting, AnEmergencyStopBySignalFollowsTheRobotsCategory) {
  rt::install_emergency_signal();
  robot.emergency_stop = StopCategory::kCategory0;
  ASSERT_EQ(::raise(SIGUSR1), 0);
  steps(1);
  EXPECT_EQ(cycle->phase(), RunPhase::kFaulted);
  EXPECT_EQ(backend->latched, StopCategory::kCategory0);
  EXPECT_EQ(cycle->faults().at(0).text, "emergency stop by a signal");
  steps(20);
  EXPECT_EQ(cycle->faults().size(), 1U) << "once per signal";
  ASSERT_EQ(::raise(SIGUSR1), 0);
  steps(1);
  EXPECT_EQ(cycle->faults().size(), 2U);
}

// `tandem estop` that met a start was said to be a signal.
TEST_F(Waiting, AnEmergencyStopBeforeThereWasALoopIsOnRequest) {
  robot.emergency_stop = StopCategory::kCategory0;
  rt::request_emergency_stop();
  steps(1);
  EXPECT_EQ(cycle->phase(), RunPhase::kFaulted);
  EXPECT_EQ(backend->latched, StopCategory::kCategory0);
  EXPECT_EQ(cycle->faults().at(0).text, "emergency stop on request");
  steps(20);
  EXPECT_EQ(cycle->faults().size(), 1U) << "once";
}

TEST_F(Waiting, AnEmergencyStopEndsARunThatDoesNotWait) {
  start({});
  cycle->inbox().emergency_stop(StopCategory::kCategory0);
  steps(1);
  EXPECT_EQ(cycle->phase(), RunPhase::kShutDown);
  EXPECT_EQ(backend->latched, StopCategory::kCategory0);
}

TEST_F(Waiting, AFaultDuringBringUpEndsTheRun) {
  backend = std::make_unique<test::FirstOrderRobot>(robot);
  begin(*backend, {.after_stop = AfterStop::kWait, .after_reset = AfterReset::kContinue});
  steps(5);
  cycle->inbox().emergency_stop(StopCategory::kCategory1);
  until(RunPhase::kDone);
  EXPECT_EQ(cycle->faults().size(), 1U);
}

TEST_F(Waiting, EveryStepIsAnEventOfTheLog) {
  const log::ScratchFolder folder;
  auto log_file = log::Recorder::open(folder / "a.mcap", {}, {});
  ASSERT_TRUE(log_file);
  start({.after_stop = AfterStop::kWait, .after_reset = AfterReset::kContinue},
        StopCategory::kCategory1, nullptr, log_file->get());
  cycle->inbox().emergency_stop(StopCategory::kCategory1);
  until(RunPhase::kFaulted);
  backend->reset_clears = false;
  cycle->inbox().reset_faults();
  until(RunPhase::kResetting);
  until(RunPhase::kFaulted);
  backend->reset_clears = true;
  cycle->inbox().reset_faults();
  until(RunPhase::kRunning);
  cycle->inbox().end_run();
  until(RunPhase::kDone);
  (void)(*log_file)->close();
  const auto log = log::LogFile::open(folder / "a.mcap");
  ASSERT_TRUE(log);
  std::vector<std::string> texts;
  const auto events = log->events();
  ASSERT_TRUE(events);
  for (const auto& event : *events) texts.push_back(event.text);
  EXPECT_EQ(texts,
            (std::vector<std::string>{"started", "bring-up done", "emergency stop on request",
                                      "reset requested", "reset failed", "reset requested",
                                      "reset done", "stop requested", "shut down"}));
}

TEST(FaultLog, CountsWhatDoesNotFit) {
  FaultLog log;
  for (std::size_t i = 0; i < FaultLog::kCapacity + 3; ++i) log.note({.cycle = i});
  EXPECT_EQ(log.size(), FaultLog::kCapacity);
  EXPECT_EQ(log.lost(), 3U);
  log.clear(0, 5);
  EXPECT_EQ(log.latched(), FaultLog::kCapacity - 1);
}

}  // namespace
}  // namespace tandem::runtime
