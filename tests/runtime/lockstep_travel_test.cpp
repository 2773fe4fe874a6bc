// An emulated robot behind a wire goes back in time with its master, in lockstep: to the bits of a
// run in one process that was never interrupted.
#include <gtest/gtest.h>

#include <cstdlib>
#include <optional>
#include <random>
#include <string>

#include "canopen/messages.hpp"
#include "tests/runtime/journey.hpp"
#include "tests/runtime/lockstep.hpp"

namespace tandem::runtime {
namespace {

using canopen::PastOrder;
using canopen::PastRefusal;
using test::LockstepRobot;

/// A wire does not show the plant's truth, so that of the run in process is left out, too.
Overrides over_a_wire(const char* hal) {
  Overrides overrides = Journey::paused([](Experiment& e) { e.sim.ground_truth = false; });
  overrides.duration_s = 30.0;
  if (hal == nullptr) return overrides;
  overrides.hal = hal;
  overrides.lockstep = true;
  return overrides;
}

struct Subject {
  const char* robot;
  const char* name;
  const char* hal;
};

/// A journey whose boards are behind a wire.
struct FarJourney {
  explicit FarJourney(const Subject& subject, std::size_t budget_bytes = TimeMachine::kBudget_bytes,
                      bool deaf = false)
      : trip(subject.robot, subject.name, over_a_wire(subject.hal), test::over(robot, true, deaf),
             nullptr, budget_bytes) {}
  /// What a stranger sends to the boards; between two cycles.
  void send(const canopen::Frame& frame, std::size_t bus) {
    (void)robot->wires[bus]->master().send({&frame, 1});
  }
  void expect_no_fault() {
    for (const FaultReport& fault : trip.run.cycle->faults()) ADD_FAILURE() << fault.text;
  }

  std::optional<LockstepRobot> robot;
  Journey trip;
};

int lockstep_travels() {
  const char* text = std::getenv("TANDEM_TRAVELS");
  return text == nullptr ? TANDEM_TRAVELS : std::stoi(text);
}

class LockstepTravel : public testing::TestWithParam<Subject> {};
INSTANTIATE_TEST_SUITE_P(Robots, LockstepTravel,
                         testing::Values(Subject{"coman", "squat", "can"},
                                         Subject{"coman", "squat_ethercat", "ethercat"},
                                         Subject{"double_pendulum", "trajectory", "can"}),
                         [](const auto& one) {
                           return std::string(one.param.robot) + "_" + one.param.name;
                         });

TEST_P(LockstepTravel, PlaysAgainToTheBitsOfARunThatWasNeverInterrupted) {
  constexpr std::uint64_t kCycles = 3'000;
  const Subject subject = GetParam();
  FarJourney far(subject);
  {
    Journey whole(subject.robot, subject.name, over_a_wire(nullptr), {});
    whole.step(2 * kCycles);
    far.trip.witness.hashes = whole.witness.hashes;
  }
  Journey& trip = far.trip;
  trip.step(kCycles);
  ASSERT_EQ(trip.witness.others, 0U) << "not yet anywhere else";
  std::uint64_t reached = kCycles;
  std::mt19937 dice(11);  // NOLINT: the same each time
  for (int i = 0; i < lockstep_travels(); ++i) {
    const std::uint64_t there = 1 + dice() % (reached - 1);  // before the first there is no cycle
    trip.go(there);
    if (i % 3 == 0) trip.go(there);  // twice from the same checkpoint
    if (i % 2 == 0) {  // a branch in which nothing changes, at times across checkpoints
      trip.step(std::min<std::uint64_t>(i % 4 == 0 ? 150 : 2'500, 2 * kCycles - trip.now()));
      reached = trip.now();
    }
    ASSERT_EQ(trip.witness.others, 0U) << "travel " << i << " to " << there;
  }
  EXPECT_GT(trip.witness.again, kCycles);
  far.expect_no_fault();
  EXPECT_EQ(far.robot->emulator->kept(), trip.machine.past().count);
}

constexpr Subject kPendulum{"double_pendulum", "trajectory", "can"};

// The emulator's part counts, too; and what the master has forgotten is forgotten there.
TEST(LockstepTravel, StatesThatAreForgottenGoOnBothSides) {
  FarJourney far(kPendulum, 200'000);
  Journey& trip = far.trip;
  trip.step(9'000);
  const KeptPast past = trip.machine.past();
  EXPECT_LT(past.count, 9U) << "some were thinned out";
  EXPECT_GE(past.count, 3U);
  EXPECT_LE(past.bytes, 200'000U);
  const sim::Emulator& emulator = *far.robot->emulator;
  EXPECT_EQ(emulator.kept(), past.count);
  EXPECT_GE(past.bytes, emulator.kept_bytes());
  trip.go(100);
  trip.step(10);  // a branch: what was ahead is no more
  EXPECT_EQ(emulator.kept(), trip.machine.past().count);
  EXPECT_EQ(emulator.kept(), 1U);
  EXPECT_EQ(trip.witness.others, 0U);
}

TEST(LockstepTravel, AnEmulatorOfAnOlderVersionIsNamedAndTheRunGoesOn) {
  FarJourney far(kPendulum, TimeMachine::kBudget_bytes, true);
  far.trip.step(1'500);
  const std::string why = far.trip.refusal(700);
  EXPECT_NE(why.find("nothing of the past is kept: the emulated robot does not answer orders about "
                     "its past (101): it is of a version that cannot go back"),
            std::string::npos)
      << why;
  EXPECT_NE(far.trip.machine.past().no_more.find("of this version"), std::string::npos);
  std::uint64_t orders = 0;
  for (const auto& ear : far.robot->ears) orders += ear->orders;
  EXPECT_EQ(orders, far.robot->ears.size()) << "it is asked once";
  far.trip.step(100);
  far.expect_no_fault();
}

TEST(LockstepTravel, AnEmulatorThatDiesOnTheWayIsAFaultThatSaysSo) {
  FarJourney far(kPendulum);
  far.trip.step(1'500);
  far.robot->emulator_runs = false;
  const std::string why = far.trip.refusal(700);
  EXPECT_NE(why.find("does not answer orders about its past (101) any more"), std::string::npos)
      << why;
  EXPECT_EQ(far.trip.now(), 1'500U) << "time is where it was";
  far.trip.step(1);
  far.trip.end();
  const auto faults = far.trip.run.cycle->faults();
  ASSERT_FALSE(faults.empty());
  EXPECT_NE(faults[0].text.find("no emulated robot answers in lockstep"), std::string::npos)
      << faults[0].text;
}

// It was started anew, say: nothing has changed on this side, and the run goes on.
TEST(LockstepTravel, AStateThatTheEmulatorDoesNotHaveIsRefused) {
  FarJourney far(kPendulum);
  far.trip.step(1'500);
  for (std::size_t b = 0; b < far.robot->wires.size(); ++b)
    far.send(canopen::make_past_order({PastOrder::kDrop, 0}), b);
  (void)far.robot->emulator->poll(0);
  const std::string why = far.trip.refusal(700);
  EXPECT_NE(why.find("the emulated robot has no such state"), std::string::npos) << why;
  EXPECT_EQ(far.trip.now(), 1'500U);
  far.trip.step(1'000);
  far.trip.go(2'200);  // those that were kept since are there
  EXPECT_EQ(far.trip.witness.others, 0U);
  far.expect_no_fault();
}

TEST(LockstepTravel, ThereIsNoPastWithoutMemoryForIt) {
  FarJourney far(kPendulum);
  far.trip.step(1'500);
  far.robot->emulator.reset();
  std::vector<hal::can::Bus*> ends;
  for (const auto& ear : far.robot->ears) ends.push_back(ear.get());
  struct Never final : hal::can::FrameWait {
    std::int64_t now_ns() noexcept override { return 0; }
    void wait(std::int64_t, int) noexcept override {}
  } never;
  far.robot->emulator = std::make_unique<sim::Emulator>(
      *far.robot->emulated, ends, never,
      sim::EmulatorConfig{.period_ns = 1'000'000, .lockstep = true, .kept_bytes = 10});
  // It steps on from where the robot is; its own time is not looked at here.
  const std::string why = far.trip.refusal(1'200);
  EXPECT_NE(far.trip.machine.past().no_more.find("has no memory for another state"),
            std::string::npos)
      << why;
}

// On one bus of several a stranger's order is none; an answer that nobody asked for is counted.
TEST(LockstepTravel, StrangersAreCountedAndChangeNothing) {
  FarJourney far({"coman", "squat", "can"});
  Journey& trip = far.trip;
  ASSERT_GT(far.robot->wires.size(), 1U);
  trip.step(1'500);
  far.send(canopen::make_past_order({PastOrder::kGoBack, 1}), 0);
  const canopen::Frame answer =
      canopen::make_past_answer({.to = {PastOrder::kGoBack, 77}, .refusal = PastRefusal::kNone});
  (void)far.robot->wires[1]->boards().send({&answer, 1});
  trip.step(100);
  trip.go(1'200);
  trip.step(700);
  EXPECT_EQ(trip.witness.others, 0U);
  far.expect_no_fault();
  trip.end();
  const std::vector<std::string> warnings = far.robot->master->warnings();
  ASSERT_EQ(warnings.size(), 1U);
  EXPECT_TRUE(warnings[0].starts_with("1 answer about the robot's past (102) came that nobody"))
      << warnings[0];
}

// What is injected into the emulator is none of the master's cycles, and cannot be played again.
TEST(LockstepTravel, WhatTheEmulatorIsGivenIsHeardByTheMaster) {
  FarJourney far(kPendulum);
  Journey& trip = far.trip;
  trip.step(3'000);
  sim::ScenarioFault freeze;
  freeze.kind = hal::FaultKind::kEncoderFreeze;
  freeze.joint = 0;
  freeze.duration_ns = 5'000'000;
  ASSERT_EQ(far.robot->emulator->inject(freeze), Code::kOk);
  trip.step(500);
  const auto within = trip.machine.go_to(*trip.run.cycle, 3'010);
  ASSERT_TRUE(within) << within.error().to_string();
  EXPECT_EQ(within->to, 3'000U) << "the cycle that heard it cannot be played again";
  trip.go(3'200);  // after the checkpoint that came soon
  trip.go(3'500);
  EXPECT_EQ(trip.witness.others, 0U);
  trip.go(2'400);
  trip.step(90);
  EXPECT_EQ(trip.witness.others, 0U);
  trip.step(700);
  EXPECT_GT(trip.witness.others, 0U) << "in this future nobody has injected it";
}

// While time stands: it is in the state that is kept before going back, and in none before.
TEST(LockstepTravel, WhatItIsGivenWhileTimeStandsIsOfThatMomentAlone) {
  FarJourney far(kPendulum);
  Journey& trip = far.trip;
  trip.step(1'500);
  sim::ScenarioFault freeze;
  freeze.kind = hal::FaultKind::kEncoderFreeze;
  freeze.joint = 0;
  freeze.duration_ns = 5'000'000;
  ASSERT_EQ(far.robot->emulator->inject(freeze), Code::kOk);
  trip.go(1'200);
  trip.go(1'500);
  ASSERT_EQ(far.robot->emulated->faults().size(), 1U);
  trip.step(200);
  trip.go(1'600);
  trip.go(1'700);
  EXPECT_EQ(trip.witness.others, 0U);
}

// A real robot gets nothing of it, whatever is asked.
TEST(LockstepTravel, OutsideOfLockstepNoOrderIsSent) {
  BundledRun pendulum("double_pendulum", "trajectory");
  const Experiment& e = *pendulum.experiment;
  LockstepRobot robot(e.robot, &pendulum.run->kernels(), e.sim_robot_config(), false);
  EXPECT_FALSE(robot.backend->keep());
  EXPECT_FALSE(robot.backend->go_back({.number = 1}));
  robot.backend->forget({.number = 1});
  for (const auto& wire : robot.wires) EXPECT_TRUE(wire->to_boards().empty());
  Archive ar;
  EXPECT_FALSE(robot.backend->archive(ar));
}

// Boards in real time are nobody's to take back.
TEST(LockstepTravel, AnEmulatorInRealTimeObeysNoOrder) {
  BundledRun pendulum("double_pendulum", "trajectory");
  const Experiment& e = *pendulum.experiment;
  auto robot = sim::EmulatedRobot::create(e.robot, &pendulum.run->kernels(), e.sim_robot_config());
  ASSERT_TRUE(robot) << robot.error().to_string();
  struct Clock final : hal::can::FrameWait {
    std::int64_t now_ns() noexcept override { return 1'000'000'000; }
    void wait(std::int64_t, int) noexcept override {}
  } clock;
  std::vector<std::unique_ptr<hal::can::LoopbackBus>> wires;
  std::vector<hal::can::Bus*> far;
  for (std::size_t b = 0; b < (*robot)->buses(); ++b) {
    wires.push_back(std::make_unique<hal::can::LoopbackBus>());
    far.push_back(&wires.back()->boards());
  }
  sim::Emulator emulator(**robot, far, clock, {e.loop.period_ns, false});
  const canopen::Frame order = canopen::make_past_order({PastOrder::kKeep, 1});
  for (const auto& wire : wires) (void)wire->master().send({&order, 1});
  (void)emulator.poll(0);
  (void)emulator.poll(0);
  EXPECT_EQ(emulator.kept(), 0U);
  for (const auto& wire : wires) {
    canopen::Frame frame;
    while (wire->master().receive({&frame, 1}) > 0) EXPECT_NE(frame.id, canopen::cob::kPastAnswer);
  }
}

}  // namespace
}  // namespace tandem::runtime
