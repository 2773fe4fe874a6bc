// Events of a run: at conditions and times, in the same cycle each time, also where time goes back.
#include "runtime/events.hpp"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "tests/runtime/journey.hpp"

namespace tandem::runtime {
namespace {

/// A push of 2 Nm about the world's y on the body of joint2, for 50 ms.
sim::ScenarioFault nudge(const hal::RobotConfig& robot) {
  sim::ScenarioFault push;
  push.kind = hal::FaultKind::kPush;
  push.joint = robot.joint_index("joint2");
  push.torque_Nm = {0.0, 2.0, 0.0};
  push.duration_ns = 50'000'000;
  return push;
}

EventSpec pushed(const Experiment& e, const std::string& when, std::int64_t after_ns = 0) {
  EventSpec spec;
  spec.name = "nudge";
  spec.when = when;
  spec.after_ns = after_ns;
  spec.fault = nudge(e.robot);
  return spec;
}

EventSpec asked(const std::string& name, std::int64_t at_ns, const std::string& when = {}) {
  EventSpec spec;
  spec.name = name;
  spec.at_ns = at_ns;
  spec.when = when;
  spec.ask = "{\"do\": \"" + name + "\"}";
  return spec;
}

Overrides with(std::function<void(Experiment&)> change) {
  Overrides overrides;
  overrides.change = std::move(change);
  return overrides;
}

std::uint64_t state_hash(const BundledRun& run) {
  return hash_of(run.run->truth().bytes(), hash_of(run.run->state().bytes(), 1));
}

// It acts from the end of the cycle in which the condition held, and ends after its time.
TEST(Events, AConditionPushesFromTheNextCycleOn) {
  BundledRun run("double_pendulum", "trajectory",
                 with([](Experiment& e) { e.events = {pushed(e, "position(joint1) > 0.1rad")}; }));
  std::uint64_t met = 0, first = 0, last = 0;
  while (run.cycle->step() && run.run->state().cycle()[0] < 3'000) {
    const std::uint64_t cycle = run.run->state().cycle()[0];
    const bool controlled = run.cycle->phase() == RunPhase::kRunning;
    if (met == 0 && controlled && run.run->state().position_rad()[0] > 0.1) met = cycle;
    if (run.run->truth().push_moment_Nm()[1] == 0.0) continue;
    EXPECT_EQ(run.run->truth().push_moment_Nm()[1], 2.0) << cycle;
    if (first == 0) first = cycle;
    last = cycle;
  }
  ASSERT_GT(met, 0U);
  EXPECT_EQ(first, met + 1);
  EXPECT_EQ(last, met + 50);
  const auto results = run.run->expectations()->results();
  ASSERT_EQ(results.size(), 1U);
  EXPECT_EQ(results[0].name, "nudge comes");
  EXPECT_TRUE(results[0].passed) << results[0].reason;
  EXPECT_NEAR(*results[0].at_s, 1e-3 * static_cast<double>(met), 1e-9);
}

// By its own time: the whole impulse comes in the step that ends at 1 s, and in those after it.
TEST(Events, APushAtATimeBeginsWithTheStepThatEndsThere) {
  BundledRun run("double_pendulum", "trajectory", with([](Experiment& e) {
                   sim::ScenarioFault push = nudge(e.robot);
                   push.start_ns = 1'000'000'000;
                   push.duration_ns = 2'500'000;
                   e.faults = {push};
                 }));
  run.steps(999 + 1);
  EXPECT_EQ(run.run->truth().time_ns()[0], 999'000'000);
  EXPECT_EQ(run.run->truth().push_moment_Nm()[1], 0.0);
  for (const double wanted : {2.0, 2.0, 0.0}) {  // of the last sub-step of each: 1, 2 and 3 ms
    run.steps(1);
    EXPECT_EQ(run.run->truth().push_moment_Nm()[1], wanted) << run.run->truth().time_ns()[0];
  }
}

// Asked in the loop's own thread, between the halves of a cycle: the cycle after the condition, or
// the first one at the time.
TEST(Events, ARequestIsCarriedOutInItsCycle) {
  std::vector<std::uint64_t> hashes;
  for (int again = 0; again < 2; ++again) {
    BundledRun run("double_pendulum", "trajectory", with([](Experiment& e) {
                     e.events = {asked("at", 1'500'000'000), asked("when", -1, "time() > 1.3s"),
                                 asked("wrong", 1'600'000'000)};
                     e.events[1].after_ns = 10'000'000;
                   }));
    std::vector<std::pair<std::string, std::uint64_t>> done;
    run.run->events()->ask_by([&](const std::string& request) -> Status {
      if (request.contains("wrong")) return fail("no such thing", "try another");
      const auto result = run.cycle->services().set_gains(
          "joint1", hal::PidLoop::kPosition, {.kp = request.contains("at") ? 40.0 : 50.0});
      if (!result) return std::unexpected(result.error());
      EXPECT_TRUE(result->done);
      done.emplace_back(request, result->cycle);
      return {};
    });
    run.steps(2'000);
    ASSERT_EQ(done.size(), 2U);
    EXPECT_EQ(done[0], std::pair(std::string("{\"do\": \"when\"}"), std::uint64_t{1'311}));
    EXPECT_EQ(done[1], std::pair(std::string("{\"do\": \"at\"}"), std::uint64_t{1'500}));
    const auto results = run.run->expectations()->results();
    ASSERT_EQ(results.size(), 3U);
    EXPECT_TRUE(results[0].passed && results[1].passed);
    EXPECT_FALSE(results[2].passed);
    EXPECT_EQ(results[2].reason, "it was refused: no such thing (try another)");
    hashes.push_back(state_hash(run));
  }
  EXPECT_EQ(hashes[0], hashes[1]);
}

TEST(Events, WhatNeverComesFailsUnlessItIsOptional) {
  BundledRun run("double_pendulum", "trajectory", with([](Experiment& e) {
                   e.events = {pushed(e, "position(joint1) > 100rad"),
                               pushed(e, "position(joint1) > 100rad"),
                               asked("late", 90'000'000'000), asked("nobody", 500'000'000)};
                   e.events[1].optional = true;
                 }));
  run.steps(1'000);
  const auto results = run.run->expectations()->results();
  ASSERT_EQ(results.size(), 4U);
  EXPECT_EQ(results[0].reason, "its condition has not held: position(joint1) > 100rad");
  EXPECT_TRUE(results[1].passed);
  EXPECT_EQ(results[2].reason, "it has not come, it is due at 90 s");
  EXPECT_EQ(results[2].awaits, "it has not come, it is due at 90 s");
  EXPECT_NE(results[3].reason.find("nobody carries out requests"), std::string::npos);
}

TEST(Events, AWrongConditionIsFoundBeforeAnythingMoves) {
  Overrides overrides = with([](Experiment& e) {
    e.events = {pushed(e, "positon(joint1) > 1rad")};
    e.events[0].when_line = 12;
  });
  overrides.no_build = true;
  const auto run =
      Run::open(TANDEM_SOURCE_DIR "/config/double_pendulum/trajectory.toml", overrides);
  ASSERT_FALSE(run);
  EXPECT_EQ(run.error().front().line, 12);
  EXPECT_NE(run.error().front().to_string().find("nudge.when"), std::string::npos);
  EXPECT_NE(run.error().front().to_string().find("did you mean 'position'"), std::string::npos);
}

// Restored in the middle of a push, the same bits follow; what has come does not come again.
TEST(Events, ASnapshotHasThem) {
  BundledRun run("coman", "squat", with([](Experiment& e) {
                   sim::ScenarioFault push;
                   push.kind = hal::FaultKind::kPush;
                   push.link = e.tree()->link_index("torso");
                   push.force_N = {-30.0, 5.0, 0.0};
                   push.shape = sim::PushShape::kHalfSine;
                   push.duration_ns = 100'000'000;
                   EventSpec spec;
                   spec.name = "bump";
                   spec.when = "phase() == running";
                   spec.after_ns = 200'000'000;
                   spec.fault = push;
                   e.events = {spec};
                 }));
  run.run_to(RunPhase::kRunning);
  run.steps(250);
  ASSERT_NE(run.run->truth().push_force_N()[0], 0.0);
  const auto within = run.cycle->save();
  ASSERT_TRUE(within);
  const std::vector<std::byte> first = run.bytes(150);
  EXPECT_EQ(run.run->truth().push_force_N()[0], 0.0);
  ASSERT_TRUE(run.cycle->restore(*within));
  EXPECT_EQ(*run.cycle->save(), *within);
  EXPECT_EQ(run.bytes(150), first);
}

// Pushes and requests come again in the branch, to the same bits, wherever time goes.
TEST(Events, ComeAgainWhereTimeWentBack) {
  Journey trip("double_pendulum", "trajectory", [](Experiment& e) {
    e.events = {pushed(e, "position(joint1) > 0.1rad"), asked("at", 1'500'000'000)};
  });
  int asks = 0;
  trip.run.run->events()->ask_by([&](const std::string&) -> Status {
    ++asks;
    const auto result =
        trip.run.cycle->services().set_gains("joint1", hal::PidLoop::kPosition, {.kp = 40.0});
    if (!result) return std::unexpected(result.error());
    return {};
  });
  trip.step(2'500);
  EXPECT_EQ(asks, 1);
  for (const std::uint64_t there : {2'300U, 700U, 1'200U, 1'500U, 30U}) {
    trip.go(there);
    EXPECT_EQ(trip.witness.others, 0U) << there;
  }
  EXPECT_EQ(asks, 1);
  trip.step(2'470);
  EXPECT_EQ(asks, 2);
  EXPECT_EQ(trip.witness.others, 0U);
  trip.go(1'505);  // by the checkpoint after the cycle that asked, which nobody plays again
  trip.step(100);
  EXPECT_EQ(asks, 2);
  EXPECT_EQ(trip.witness.others, 0U);
}

}  // namespace
}  // namespace tandem::runtime
