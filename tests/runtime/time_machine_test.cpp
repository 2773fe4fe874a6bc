// Time that goes back, and on again to the same bits: bundled experiments with their whole chain,
// as `tandem run` runs them, with a loop on a thread of its own.
#include "runtime/time_machine.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <cstdlib>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "log/log_file.hpp"
#include "runtime/logged_state.hpp"
#include "tests/log/scratch_folder.hpp"
#include "tests/runtime/journey.hpp"

namespace tandem::runtime {
namespace {

struct Journeyed {
  const char* robot;
  const char* name;
};
class TimeMachineOf : public testing::TestWithParam<Journeyed> {};
INSTANTIATE_TEST_SUITE_P(Experiments, TimeMachineOf,
                         testing::Values(Journeyed{"coman", "squat"},
                                         Journeyed{"coman", "squat_ethercat"},
                                         Journeyed{"double_pendulum", "trajectory"},
                                         Journeyed{"walkman", "squat"}, Journeyed{"panda", "hold"}),
                         [](const auto& one) {
                           return std::string(one.param.robot) + "_" + one.param.name;
                         });

/// How many journeys of an experiment; `make test-all` wants more.
int travels() {
  const char* text = std::getenv("TANDEM_TRAVELS");
  return text == nullptr ? TANDEM_TRAVELS : std::stoi(text);
}

TEST_P(TimeMachineOf, PlaysAgainToTheSameBits) {
  Journey trip(GetParam().robot, GetParam().name);
  trip.step(4'000);
  std::uint64_t reached = 4'000;
  std::mt19937 dice(7);  // NOLINT: the same each time
  for (int i = 0; i < travels(); ++i) {
    const std::uint64_t there = dice() % reached;
    trip.go(there);
    if (i % 3 == 0) trip.go(there);  // twice from the same checkpoint
    if (i % 2 == 0) {  // a branch in which nothing changes, at times across checkpoints
      trip.step(i % 4 == 0 ? 150 : 2'500);
      reached = trip.now();
    }
    ASSERT_EQ(trip.witness.others, 0U) << "travel " << i << " to " << there;
  }
  EXPECT_GE(trip.witness.again, static_cast<std::uint64_t>(travels()));
}

// A shadow goes along, and so does a switch that waits for it: it happens again in the same cycle.
TEST(TimeMachine, GoesBackWithAShadow) {
  constexpr RunServices::Patience kNow{0};
  Journey trip("coman", "squat", [](Experiment& e) {
    e.controllers.push_back({"hold", "rest", false, TomlDocument::parse("", "rest")->root()});
  });
  trip.step(1'500);  // it stands
  RunServices& services = trip.run.cycle->services();
  ASSERT_TRUE(services.begin_shadow("rest", kNow));
  trip.step(3'000);  // it is down
  EXPECT_GT(std::abs(services.shadows().at(0).joints.at(0).most[0]), 0.1);
  ASSERT_TRUE(services.switch_when({"squat"}, {"rest"}, 0.1, 10'000'000'000, kNow));
  trip.step(500);
  EXPECT_EQ(services.last_switch().state, SwitchState::kWaits);
  trip.step(4'500);
  const SwitchLook done = services.last_switch();
  ASSERT_EQ(done.state, SwitchState::kDone);
  EXPECT_GT(done.cycle, 5'000U);
  for (const std::uint64_t back : {done.cycle - 100, std::uint64_t{4'900}}) {
    trip.go(back);
    EXPECT_EQ(services.last_switch().state, SwitchState::kWaits);
    EXPECT_TRUE(services.controllers()[1].shadow);
    trip.go(9'000);
    EXPECT_EQ(services.last_switch().cycle, done.cycle);
    EXPECT_TRUE(services.controllers()[1].active);
  }
  trip.go(done.cycle - 10);
  trip.step(1'000);  // a branch in which nothing changes
  EXPECT_EQ(services.last_switch().cycle, done.cycle);
  EXPECT_EQ(trip.witness.others, 0U);
}

TEST(TimeMachine, SaysWhereItCannotGo) {
  Journey trip("double_pendulum", "trajectory");
  trip.step(100);
  EXPECT_NE(trip.refusal(101).find("is not there yet; the run has reached 0.099 s"),
            std::string::npos);
  trip.go(50);
  trip.go(100);  // nothing has happened since: it is still there
  trip.go(50);
  trip.step(1);
  EXPECT_NE(trip.refusal(100).find("not there yet; the run has reached 0.05 s"), std::string::npos);
}

// A search went on to its end, whoever asked for a stop.
TEST(TimeMachine, AStopEndsASearch) {
  Journey trip("double_pendulum", "trajectory");
  trip.step(3'000);
  std::uint64_t looks = 0;
  const auto found = trip.machine.back_until(*trip.run.cycle, [&](const hal::CycleView&) {
    if (++looks == 10) (void)trip.run.cycle->inbox().emergency_stop(hal::StopCategory::kCategory1);
    return false;
  });
  ASSERT_FALSE(found);
  EXPECT_EQ(found.error().message, "a stop was asked for meanwhile");
  EXPECT_EQ(looks, 10U);
  EXPECT_EQ(trip.now(), 3'000U) << "time is where it was";
  trip.step(1);
  EXPECT_EQ(trip.run.cycle->phase(), RunPhase::kShutDown) << "a fault ends this run";
}

TEST(TimeMachine, KeepsWhatItHeardByACheckpointSoonAfter) {
  Journey trip("double_pendulum", "trajectory");
  trip.step(2'000);
  trip.run.cycle->inbox().reset_faults();  // nothing to reset, but it was heard
  trip.step(500);
  const auto before = trip.machine.go_to(*trip.run.cycle, 2'010);
  ASSERT_TRUE(before) << before.error().to_string();
  EXPECT_EQ(before->to, 2'000U);  // the cycle that heard it cannot be played again
  trip.go(2'200);                 // after the checkpoint that came soon
  EXPECT_EQ(trip.witness.others, 0U);
}

TEST(TimeMachine, FindsWhereSomethingBecameTrueLast) {
  Journey trip("double_pendulum", "trajectory");
  trip.step(3'000);
  const auto moves = [](const hal::CycleView& view) {
    return view.state.velocity_rad_s()[0] > 0.1;
  };
  // The same by looking at each moment.
  std::uint64_t last = 0;
  bool before = false;
  for (std::uint64_t moment = 2'600; moment < 3'000; ++moment) {
    trip.go(moment);
    const bool now = moves(trip.run.cycle->last_view());
    if (now && !before && moment > 2'600) last = moment;
    before = now;
    ASSERT_EQ(trip.witness.others, 0U) << moment;
  }
  ASSERT_GT(last, 0U);
  trip.go(3'000);
  const auto found = trip.machine.back_until(*trip.run.cycle, moves);
  ASSERT_TRUE(found) << found.error().to_string();
  EXPECT_EQ(found->to, last);
  EXPECT_EQ(trip.now(), last);
  const auto never = trip.machine.back_until(
      *trip.run.cycle, [](const hal::CycleView& view) { return view.time.cycle > 99'999; });
  ASSERT_FALSE(never);
  EXPECT_NE(never.error().message.find("has not become true since 0 s"), std::string::npos);
  EXPECT_EQ(trip.now(), last);
  // And forwards.
  ASSERT_TRUE(trip.machine.until(
      *trip.run.cycle, [](const hal::CycleView& view) { return view.time.cycle == 2'950; },
      "2950"));
  while (!trip.clock().state().standing) std::this_thread::yield();
  EXPECT_EQ(trip.now(), 2'951U);
  EXPECT_EQ(trip.witness.others, 0U);
}

// The second one replaced the first and nobody was told.
TEST(TimeMachine, SaysWhichConditionIsWaitedForAndWhichItGivesUp) {
  Journey trip("double_pendulum", "trajectory");
  trip.step(100);
  RobotCycle& cycle = *trip.run.cycle;
  ASSERT_TRUE(cycle.inbox().clock().set_rate(0.01)) << "so that it does not end meanwhile";
  const auto never = [](const hal::CycleView&) { return false; };
  EXPECT_EQ(trip.machine.awaited(), "");
  const auto begin = [&](const CycleCondition& holds, const char* words) {
    return trip.machine.until(cycle, holds, words).value_or(Awaited{.replaced = "?"});
  };
  EXPECT_EQ(begin(never, "first").replaced, "");
  EXPECT_EQ(trip.machine.awaited(), "first");
  const Awaited second = begin(never, "second");
  EXPECT_EQ(second.replaced, "first");
  EXPECT_FALSE(second.holds_now);
  EXPECT_EQ(trip.machine.awaited(), "second");
  EXPECT_EQ(trip.machine.give_up(cycle).value_or("?"), "second");
  EXPECT_EQ(trip.machine.awaited(), "");
  EXPECT_FALSE(trip.clock().state().paused) << "it went on before";
  const auto none = trip.machine.give_up(cycle);
  ASSERT_FALSE(none);
  EXPECT_EQ(none.error().message, "no condition is waited for");
  EXPECT_FALSE(trip.machine.met());
  EXPECT_TRUE(begin([](const hal::CycleView&) { return true; }, "always").holds_now)
      << "it has to end first, which nobody was told";
  ASSERT_TRUE(trip.machine.until(cycle, never, "third"));
  trip.go(100);
  EXPECT_EQ(trip.machine.awaited(), "") << "it was about the time that would have come";
}

// What had been seen of a future that does not come counted, too.
TEST(TimeMachine, ExpectationsAreOfTheBranch) {
  ExpectationSpec never;
  never.kind = ExpectationKind::kNever;
  never.name = "late";
  never.text = "time() > 2 s";
  Journey trip("double_pendulum", "trajectory", nullptr, {never});
  const auto late = [&] { return trip.run.run->expectations()->results().front(); };
  trip.step(1'500);
  const ExpectationResult before = late();
  EXPECT_TRUE(before.passed) << before.reason;
  trip.step(1'500);
  EXPECT_FALSE(late().passed);
  trip.go(1'500);
  EXPECT_EQ(late(), before);
  trip.step(100);
  EXPECT_TRUE(late().passed);
  trip.step(1'400);
  EXPECT_FALSE(late().passed);
}

TEST(TimeMachine, ThinsOutToItsBudget) {
  Checkpoints kept(1'000);
  for (std::uint64_t second = 0; second < 1'000; ++second) {
    kept.add({.cycle = second * 1'000, .bytes = std::vector<std::byte>(50)});
    ASSERT_LE(kept.bytes(), 1'000U);
  }
  ASSERT_EQ(kept.all().size(), 20U);
  EXPECT_EQ(kept.all().front().cycle, 0U);
  EXPECT_EQ(kept.all().back().cycle, 999'000U);
  // The older, the further apart: none of the gaps is much more than what lies behind it.
  for (std::size_t i = 1; i + 1 < kept.all().size(); ++i) {
    const double gap = static_cast<double>(kept.all()[i + 1].cycle - kept.all()[i].cycle);
    EXPECT_LE(gap, 2'000.0 + static_cast<double>(999'000 - kept.all()[i].cycle)) << i;
  }
  EXPECT_LE(kept.all().back().cycle - kept.all()[18].cycle, 3'000U);
}

// Boards told of a fault, and frames were lost, in a future that does not come.
TEST(TimeMachine, WarnsOfNothingThatWasForgotten) {
  Journey trip("coman", "squat");
  trip.step(3'000);
  ASSERT_EQ(trip.run.backend->master().warnings(), std::vector<std::string>{});
  sim::ScenarioFault freeze;
  freeze.kind = hal::FaultKind::kEncoderFreeze;
  freeze.joint = 3;
  freeze.start_ns = 3'050'000'000;
  freeze.duration_ns = 400'000'000;
  ASSERT_TRUE(trip.run.backend->post(freeze));
  trip.step(600);
  ASSERT_EQ(trip.run.cycle->faults().size(), 1U);
  trip.go(2'900);
  trip.step(300);
  EXPECT_EQ(trip.run.cycle->faults().size(), 0U);
  EXPECT_EQ(trip.run.backend->master().warnings(), std::vector<std::string>{});
}

// The 65th was confirmed, and left out.
TEST(TimeMachine, AFaultWithoutRoomIsRefusedAndNotLost) {
  BundledRun run("double_pendulum", "trajectory");
  sim::ScenarioFault lasting;
  lasting.kind = hal::FaultKind::kFrameDelay;
  lasting.start_ns = 1'000'000'000'000;
  for (int cycle = 0; cycle < 4; ++cycle) {
    for (int i = 0; i < 16; ++i) ASSERT_TRUE(run.backend->post(lasting)) << cycle << " " << i;
    EXPECT_FALSE(run.backend->post(lasting)) << "at most 16 a cycle";
    run.steps(1);
  }
  EXPECT_FALSE(run.backend->post(lasting));
}

constexpr RunServices::Patience kAtOnce{0};

TEST(TimeMachine, CallsOfCyclesThatHaveBeenAreNotCounted) {
  Journey trip("double_pendulum", "jog");
  trip.step(2'000);
  const auto& calls = trip.run.run->controllers().loaded()[0]->times->calls;
  const std::uint64_t before = calls.count();
  trip.go(1'500);
  EXPECT_EQ(calls.count(), before);
  trip.step(10);
  EXPECT_EQ(calls.count(), before + 10);
}

// A request, a sample and a fault were carried out in the next cycle, wherever that was.
TEST(TimeMachine, WhatWaitsIsDroppedWhenTimeGoesElsewhere) {
  Journey trip("double_pendulum", "jog", [](Experiment& e) {
    e.controllers[0].inputs = {{.name = "rate", .feeder = InputFeeder::kCommand}};
  });
  trip.step(2'000);
  RunServices& services = trip.run.cycle->services();
  const auto asked = services.switch_controllers({"jog"}, {}, kAtOnce);
  ASSERT_TRUE(asked) << asked.error().to_string();
  EXPECT_FALSE(asked->done);
  const std::shared_ptr<InputPort> rate = trip.run.run->controllers().loaded()[0]->inputs[0];
  const double sample[]{0.4};
  ASSERT_TRUE(rate->offer(InputFeeder::kCommand, sample));
  sim::ScenarioFault freeze;
  freeze.kind = hal::FaultKind::kEncoderFreeze;
  ASSERT_TRUE(trip.run.backend->post(freeze));
  trip.go(1'500);
  EXPECT_EQ(trip.run.cycle->progress().went_to_ns, 1'499'000'000);
  std::vector<hal::TextEvent> said;
  std::uint64_t seen = 0;
  (void)services.texts().read(seen, said);
  ASSERT_EQ(said.size(), 1U);
  EXPECT_EQ(
      said[0].words(),
      "went elsewhere: dropped what waited for the next cycle: 1 request (controller.switch), 1 "
      "sample of an input, 1 fault");
  trip.step(1'500);  // as if nobody had asked
  EXPECT_EQ(trip.witness.others, 0U);
  EXPECT_EQ(rate->look().counts.arrived, 0U);
  EXPECT_EQ(rate->look().counts.refused, 1U);
  EXPECT_TRUE(trip.run.backend->robot().faults().empty());
  EXPECT_TRUE(services.controllers()[0].active);
  // What is asked for there counts there.
  ASSERT_TRUE(services.switch_controllers({"jog"}, {}, kAtOnce));
  trip.step(1);
  EXPECT_FALSE(services.controllers()[0].active);
}

// It kept the numbers of a future that does not come.
TEST(TimeMachine, AnInactiveControllersSignalsAreThoseOfTheMoment) {
  Journey trip("double_pendulum", "trajectory", [](Experiment& e) {
    e.controllers[0].active = false;
    e.controllers.push_back({"hold", "rest", true, TomlDocument::parse("", "rest")->root()});
  });
  trip.step(2'000);
  RunServices& services = trip.run.cycle->services();
  const auto newest_ns = [&] { return services.signals().at(0).block->look().time_ns; };
  EXPECT_EQ(newest_ns(), -1) << "it has not told anything yet";
  ASSERT_TRUE(services.switch_controllers({"rest"}, {"joint_trajectory"}, kAtOnce));
  trip.step(500);
  EXPECT_EQ(newest_ns(), 2'499'000'000);
  trip.go(1'500);
  EXPECT_EQ(newest_ns(), -1);
}

TEST(TimeMachine, WhatWasSaidInAForgottenFutureIsReadByNobody) {
  TextHistory history;
  const auto say = [&](std::int64_t time_ns) {
    history.write(hal::TextEvent{.cycle = 0, .time_ns = time_ns});
  };
  for (const std::int64_t time_ns : {1, 2, 3}) say(time_ns);
  history.forget_after(2);
  say(4);
  std::vector<hal::TextEvent> read;
  std::uint64_t seen = 0;
  EXPECT_EQ(history.read(seen, read), 0U);
  EXPECT_EQ(seen, 4U);
  ASSERT_EQ(read.size(), 3U);
  EXPECT_EQ(read[1].time_ns, 2);
  EXPECT_EQ(read[2].time_ns, 4);
}

// Its exact twin has the same bits in each branch, and no cycle more or less.
TEST(TimeMachine, TheSecondRobotGoesAlong) {
  const log::ScratchFolder folder;
  const std::string path = folder / "run.mcap";
  auto recorder = log::Recorder::open(path, {.robot = "coman", .period_ns = 1'000'000}, {});
  ASSERT_TRUE(recorder);
  std::uint64_t played = 0;
  {
    Journey trip("coman", "squat_twin", recorder->get());
    trip.step(1'300);
    trip.go(1'250);
    trip.go(900);
    trip.step(450);
    trip.go(1'000);  // a checkpoint: nothing is played again
    trip.step(50);
    EXPECT_EQ(trip.witness.others, 0U);
    trip.end();
    played = trip.run.run->parallel()->finish().cycles;
    EXPECT_EQ(trip.run.run->parallel()->differences().compared(), played);
    EXPECT_EQ(trip.run.run->parallel()->differences().unequal(), 0U);
  }
  EXPECT_EQ((*recorder)->close().branches, 3U);
  struct Expected {
    const char* file;
    std::uint64_t first, end;
  };
  for (const Expected& expected :
       {Expected{"run.mcap", 0, 1'300}, Expected{"run.branch-2.mcap", 900, 1'350},
        Expected{"run.branch-3.mcap", 1'000, played}}) {
    auto log = log::LogFile::open(folder / expected.file);
    ASSERT_TRUE(log) << log.error().to_string();
    const std::vector<log::Column> columns{{"cycle"}, {"position_rad", 3}, {"torque_nm", 5}};
    const auto first = log->read("/tandem/state", columns);
    const auto second = log->read("/tandem/parallel/state", columns);
    ASSERT_TRUE(first) << first.error().to_string();
    ASSERT_TRUE(second) << second.error().to_string();
    ASSERT_EQ(first->columns[0].size(), expected.end - expected.first) << expected.file;
    EXPECT_EQ(first->columns[0].front(), static_cast<double>(expected.first)) << expected.file;
    EXPECT_TRUE(first->columns == second->columns) << expected.file;
  }
}

// In another process as here: nothing of the first run is left.
TEST(TimeMachine, GoesOnFromALog) {
  const log::ScratchFolder folder;
  const std::string path = (folder / "run.mcap");
  Witness witness;
  {
    auto recorder = log::Recorder::open(path, {.robot = "coman", .period_ns = 1'000'000}, {});
    ASSERT_TRUE(recorder);
    TimeMachine machine(1'000'000, TimeMachine::kBudget_bytes, false);
    BundledRun run("coman", "squat", {},
                   {.recorder = recorder->get(), .observer = &witness, .time_machine = &machine});
    machine.log_to(states_to(**recorder, 1'000'000));
    run.steps(5'100);
    run.cycle->inbox().reset_faults();  // nothing to reset, but it was heard
    run.steps(1'400);
    EXPECT_EQ((*recorder)->close().error, "");
  }
  const auto begin = [&](double time_s, const char* experiment, std::uint64_t next,
                         const Overrides& overrides = {}) {
    const auto found = beginning_at({path, time_s});
    if (!found) return found.error().to_string();
    EXPECT_EQ(found->next, next);
    EXPECT_EQ(found->branch.of, "run.mcap");
    EXPECT_EQ(found->branch.cycle, next);
    TimeMachine machine(1'000'000, TimeMachine::kBudget_bytes, true);
    BundledRun run("coman", experiment, overrides,
                   {.observer = &witness, .time_machine = &machine});
    const Status begun = machine.begin(*run.cycle, found->from, found->next);
    if (!begun) return begun.error().to_string();
    const std::uint64_t again = witness.again;
    run.steps(300);
    EXPECT_EQ(run.cycle->next_cycle(), next + 300);
    EXPECT_EQ(witness.again - again, 300U);
    EXPECT_EQ(witness.others, 0U);
    return std::string();
  };
  EXPECT_EQ(begin(1.2, "squat", 1'201), "");
  EXPECT_EQ(begin(5.05, "squat", 5'051), "");
  EXPECT_EQ(begin(5.15, "squat", 5'100), "");  // what was heard then cannot be played again
  EXPECT_EQ(begin(6.15, "squat", 6'151), "");  // a state was logged soon after
  EXPECT_NE(begin(1.2, "hold", 1'201).find("the snapshot is of another run"), std::string::npos);
  Overrides shorter;
  shorter.duration_s = 2.0;
  for (const double time_s : {3.5, 6.15}) {
    const auto next = static_cast<std::uint64_t>(std::llround(time_s * 1e3)) + 1;
    const std::string said = begin(time_s, "squat", next, shorter);
    EXPECT_NE(said.find("the run is over before "), std::string::npos) << time_s << " s: " << said;
  }
  EXPECT_NE(begin(9.0, "squat", 0).find("9 s is after its end, of 6.499 s"), std::string::npos);
}

// It waited for what the cycles after it would hear, so a run that was killed had lost it.
TEST(TimeMachine, TellsOfAStateAtOnce) {
  std::vector<std::uint64_t> states, heard;
  TimeMachine machine(1'000'000, TimeMachine::kBudget_bytes, false);
  BundledRun run("double_pendulum", "trajectory", {}, {.time_machine = &machine});
  machine.log_to({.state = [&](const Checkpoint& one) { states.push_back(one.cycle); },
                  .heard = [&](std::uint64_t cycle) { heard.push_back(cycle); }});
  run.steps(1);
  EXPECT_EQ(states, (std::vector<std::uint64_t>{0}));
  run.steps(4);
  for (int i = 0; i < 2; ++i) {
    run.cycle->inbox().reset_faults();  // nothing to reset, but it was heard
    run.steps(2);
  }
  EXPECT_EQ(states.size(), 1U);
  EXPECT_EQ(heard, (std::vector<std::uint64_t>{5}));  // the first of that state is enough
}

// One of a run that was killed, and one whose boards keep its states in a process of their own.
TEST(TimeMachine, NamesTheLogThatABranchWithoutAStateGoesOnFrom) {
  const log::ScratchFolder folder;
  const auto refused = [&](const std::string& hal) {
    const std::string path = (folder / (hal + ".mcap"));
    auto recorder = log::Recorder::open(path,
                                        {.robot = "coman",
                                         .hal = hal,
                                         .branch = {.of = "run.mcap", .cycle = 301},
                                         .period_ns = 1'000'000},
                                        {});
    EXPECT_TRUE(recorder);
    (*recorder)->start();
    EXPECT_EQ((*recorder)->close().error, "");
    const auto begins = beginning_at({path, 0.4});
    return begins ? "none" : begins.error().hint;
  };
  EXPECT_EQ(refused("sim"), "go on from run.mcap, at a moment up to 0.3 s");
  EXPECT_EQ(refused("can"),
            "only runs that could go back in time, with their boards in this process, log some "
            "(docs/time.md)");
}

TEST(TimeMachine, SaysWhatIsNoMomentOfALog) {
  for (const char* text : {"", "run.mcap", "@1s", "run.mcap@", "run.mcap@soon", "run.mcap@-1s",
                           "run.mcap@1h", "run.mcap@nan", "run.mcap@1e400"}) {
    const auto read = LogMoment::read(text);
    ASSERT_FALSE(read) << text;
    EXPECT_EQ(read.error().message, "is no moment of a log") << text;
  }
  const auto read = LogMoment::read("a@b/run.mcap@1500ms");
  ASSERT_TRUE(read);
  EXPECT_EQ(read->log, "a@b/run.mcap");
  EXPECT_EQ(read->time_s, 1.5);
}

TEST(TimeMachine, ABranchHasALogOfItsOwn) {
  const log::ScratchFolder folder;
  const std::string path = (folder / "run.mcap");
  {
    auto recorder = log::Recorder::open(
        path, {.robot = "double_pendulum", .joints = {"joint1", "joint2"}, .period_ns = 1'000'000},
        {});
    ASSERT_TRUE(recorder);
    {
      Journey trip("double_pendulum", "trajectory", recorder->get());
      trip.step(1'000);
      trip.go(600);
      trip.go(300);
      trip.step(400);
      trip.go(700);  // nowhere else: no branch
      trip.step(100);
      trip.go(100);
      trip.step(50);
    }
    const log::RecordingResult result = (*recorder)->close();
    EXPECT_EQ(result.error, "");
    EXPECT_EQ(result.branches, 3U);
    EXPECT_EQ(result.path, (folder / "run.branch-3.mcap"));
  }
  struct Expected {
    const char* file;
    const char* of;
    std::uint64_t first, last;
  };
  for (const Expected& expected :
       {Expected{"run.mcap", "", 0, 999}, Expected{"run.branch-2.mcap", "run.mcap", 300, 799},
        Expected{"run.branch-3.mcap", "run.branch-2.mcap", 100, 149}}) {
    auto log = log::LogFile::open((folder / expected.file));
    ASSERT_TRUE(log) << log.error().to_string();
    EXPECT_EQ(log->info().branch.of, expected.of) << expected.file;
    EXPECT_EQ(log->info().branch.cycle, expected.first) << expected.file;
    const auto read = log->read("/tandem/state", {{.field = "cycle"}});
    ASSERT_TRUE(read) << read.error().to_string();
    const std::vector<double>& cycles = read->columns[0];
    ASSERT_GT(cycles.size(), expected.last - expected.first) << expected.file;
    const auto begins = beginning_at({log->path(), 1e-3 * static_cast<double>(expected.first + 9)});
    ASSERT_TRUE(begins) << begins.error().to_string();
    EXPECT_EQ(begins->from.cycle, expected.first) << expected.file;
    for (std::size_t i = 0; i < cycles.size(); ++i) {
      ASSERT_EQ(cycles[i], static_cast<double>(expected.first + i)) << expected.file;
    }
  }
  // The second one, which it went on from, began after that.
  const auto before = beginning_at({folder / "run.branch-3.mcap", 0.05});
  ASSERT_FALSE(before);
  EXPECT_EQ(before.error().hint, "that moment is in run.mcap");
}

}  // namespace
}  // namespace tandem::runtime
