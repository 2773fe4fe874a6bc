// The run's phases as a table, without a robot: every phase, every event, every guard.
#include "runtime/run_machine.hpp"

#include <gtest/gtest.h>

#include <map>
#include <utility>

namespace tandem::runtime::phases {  // whose names are those of other tests' constants
namespace {

using enum RunPhase;
using hal::StopCategory;

constexpr RunPhase kPhases[] = {kBringUp,  kSettling, kRunning, kFaulted,   kResetting,
                                kShutDown, kDone,     kHeld,    kRetreating};

using Table = std::map<std::pair<RunPhase, RunEvent>, RunPhase>;

/// Transitions of a run that neither settles nor waits, nor holds controllers back. What is not in
/// the table changes nothing.
const Table kTable = {
    {{kBringUp, RunEvent::kEnabled}, kRunning},
    {{kBringUp, RunEvent::kStop}, kShutDown},
    {{kBringUp, RunEvent::kEnd}, kShutDown},
    {{kSettling, RunEvent::kSettled}, kRunning},
    {{kSettling, RunEvent::kStop}, kShutDown},
    {{kSettling, RunEvent::kReset}, kResetting},
    {{kSettling, RunEvent::kEnd}, kShutDown},
    {{kRunning, RunEvent::kFinished}, kShutDown},
    {{kRunning, RunEvent::kStop}, kShutDown},
    {{kRunning, RunEvent::kRetreat}, kRetreating},
    {{kRunning, RunEvent::kReset}, kResetting},
    {{kRunning, RunEvent::kEnd}, kShutDown},
    {{kRetreating, RunEvent::kStop}, kShutDown},
    {{kRetreating, RunEvent::kEnd}, kShutDown},
    {{kFaulted, RunEvent::kFinished}, kShutDown},
    {{kFaulted, RunEvent::kStop}, kShutDown},
    {{kFaulted, RunEvent::kReset}, kResetting},
    {{kFaulted, RunEvent::kEnd}, kShutDown},
    {{kResetting, RunEvent::kEnabled}, kRunning},
    {{kResetting, RunEvent::kStop}, kShutDown},
    {{kResetting, RunEvent::kResetFailed}, kFaulted},
    {{kResetting, RunEvent::kEnd}, kShutDown},
    {{kHeld, RunEvent::kFinished}, kShutDown},
    {{kHeld, RunEvent::kStop}, kShutDown},
    {{kHeld, RunEvent::kStart}, kRunning},
    {{kHeld, RunEvent::kEnd}, kShutDown},
    {{kShutDown, RunEvent::kDisabled}, kDone},
};

/// @param difference  from kTable
void expect_table(RunGuards guards, const Table& difference) {
  for (const RunPhase phase : kPhases) {
    for (const RunEvent event : kRunEvents) {
      RunPhase expected = phase;
      if (const auto row = kTable.find({phase, event}); row != kTable.end()) expected = row->second;
      if (const auto row = difference.find({phase, event}); row != difference.end()) {
        expected = row->second;
      }
      EXPECT_EQ(next_phase(phase, event, guards), expected)
          << to_string(phase) << ", event " << static_cast<int>(event);
    }
  }
}

TEST(RunMachine, FollowsItsTable) { expect_table({}, {}); }

TEST(RunMachine, SettlesBeforeControllersRun) {
  expect_table({.settles = true}, {{{kBringUp, RunEvent::kEnabled}, kSettling},
                                   {{kResetting, RunEvent::kEnabled}, kSettling}});
}

TEST(RunMachine, WaitsAfterAStopButNotDuringBringUp) {
  expect_table({.waits = true}, {{{kSettling, RunEvent::kStop}, kFaulted},
                                 {{kRunning, RunEvent::kStop}, kFaulted},
                                 {{kRetreating, RunEvent::kStop}, kFaulted},
                                 {{kFaulted, RunEvent::kStop}, kFaulted},
                                 {{kResetting, RunEvent::kStop}, kFaulted},
                                 {{kHeld, RunEvent::kStop}, kFaulted},
                                 {{kFaulted, RunEvent::kFinished}, kFaulted},
                                 {{kHeld, RunEvent::kFinished}, kHeld}});
}

TEST(RunMachine, HoldsUntilControllersAreStarted) {
  expect_table({.settles = true, .holds_back = true}, {{{kBringUp, RunEvent::kEnabled}, kHeld},
                                                       {{kResetting, RunEvent::kEnabled}, kHeld}});
}

/// One that has come to `phase` in cycle 100; its time before that is 60 cycles of kRunning.
RunMachine in(RunPhase phase, const CycleConfig& config) {
  RunMachine run(config);
  if (phase == kBringUp) return run;
  if (phase == kShutDown || phase == kDone) {
    run.on(RunEvent::kEnd, 100);
    if (phase == kDone) run.on(RunEvent::kDisabled, 100);
    return run;
  }
  run.on(RunEvent::kEnabled, phase == kSettling ? 100 : 30);
  if (phase == kSettling) return run;
  run.on(RunEvent::kSettled, 40);
  if (phase == kRunning) return run;
  run.on(phase == kRetreating ? RunEvent::kRetreat : RunEvent::kStop, 100);
  if (phase == kResetting || phase == kHeld) run.on(RunEvent::kReset, 100);
  if (phase == kHeld) run.on(RunEvent::kEnabled, 100, true);
  return run;
}

struct Lasts {
  RunPhase phase;
  std::uint64_t until;  ///< the first cycle in which its time is over; 0: never
};

TEST(RunMachine, TellsWhenAPhasesTimeIsOver) {
  CycleConfig config{.running_cycles = 500,
                     .bring_up_cycles = 20,
                     .settle_cycles = 7,
                     .shut_down_cycles = 11,
                     .after_stop = AfterStop::kWait,
                     .retreat_cycles = 13};
  const auto check = [&config](std::initializer_list<Lasts> all) {
    for (const auto& [phase, until] : all) {
      const RunMachine run = in(phase, config);
      ASSERT_EQ(run.phase(), phase);
      if (until == 0) {
        EXPECT_FALSE(run.time_is_over(1'000'000'000)) << to_string(phase);
        continue;
      }
      EXPECT_FALSE(run.time_is_over(until - 1)) << to_string(phase);
      EXPECT_TRUE(run.time_is_over(until)) << to_string(phase);
    }
  };
  check({{kBringUp, 20},
         {kSettling, 107},
         {kRunning, 540},
         {kRetreating, 113},
         {kFaulted, 0},
         {kResetting, 120},
         {kHeld, 0},
         {kShutDown, 111},
         {kDone, 0}});
  config.running_cycles = 0;  // until it is stopped
  check({{kRunning, 0}, {kFaulted, 0}});
}

TEST(RunMachine, ARobotThatHoldsItsJointsEndsWhenTheRunsTimeIsOver) {
  RunMachine run({.running_cycles = 500, .after_stop = AfterStop::kEnd});
  run.on(RunEvent::kEnabled, 40);
  ASSERT_TRUE(run.latch(StopCategory::kHold));
  EXPECT_TRUE(run.on(RunEvent::kStop, 100));
  EXPECT_EQ(run.phase(), kFaulted) << "held: no shut-down";
  EXPECT_FALSE(run.time_is_over(539));
  EXPECT_TRUE(run.time_is_over(540)) << "60 cycles before, 440 since";
  ASSERT_TRUE(run.latch(StopCategory::kCategory1));
  EXPECT_TRUE(run.on(RunEvent::kStop, 200));
  EXPECT_EQ(run.phase(), kShutDown) << "a harder stop ends it";
}

TEST(RunMachine, TimeBeforeAResetCounts) {
  RunMachine run({.running_cycles = 500, .after_stop = AfterStop::kWait});
  run.on(RunEvent::kEnabled, 40);
  run.on(RunEvent::kStop, 100);
  run.on(RunEvent::kReset, 300);
  run.on(RunEvent::kEnabled, 400);
  EXPECT_EQ(run.phase(), kRunning);
  EXPECT_FALSE(run.time_is_over(839)) << "60 cycles before";
  EXPECT_TRUE(run.time_is_over(840));
}

TEST(RunMachine, LatchesTheHardestStop) {
  RunMachine run(CycleConfig{});
  EXPECT_EQ(run.latched(), StopCategory::kWarn);
  EXPECT_FALSE(run.latch(StopCategory::kWarn));
  EXPECT_TRUE(run.latch(StopCategory::kHold));
  EXPECT_TRUE(run.latch(StopCategory::kCategory0));
  EXPECT_TRUE(run.latch(StopCategory::kCategory1)) << "it is carried out again";
  EXPECT_EQ(run.latched(), StopCategory::kCategory0);
  run.unlatch();
  EXPECT_EQ(run.latched(), StopCategory::kWarn);
}

TEST(RunMachine, OnlyAHarderStopEndsARetreat) {
  RunMachine run = in(kRetreating, {.after_stop = AfterStop::kWait});
  EXPECT_TRUE(run.controllers_run());
  EXPECT_FALSE(run.latch(StopCategory::kHold));
  EXPECT_FALSE(run.latch(StopCategory::kCategory2));
  EXPECT_TRUE(run.latch(StopCategory::kCategory1));
}

}  // namespace
}  // namespace tandem::runtime::phases
