// Expectations: what passes, by how much, and that nothing passes which nobody measured.
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <thread>
#include <vector>

#include "rt/scoped_realtime.hpp"
#include "runtime/condition/expectations.hpp"
#include "tests/runtime/condition_robot.hpp"

namespace tandem::runtime {
namespace {

constexpr double kUnmeasured = std::numeric_limits<double>::quiet_NaN();

struct ExpectationTest : test::ConditionRobot, testing::Test {
  using Cycle = std::function<void(std::uint64_t)>;

  static ExpectationSpec spec(ExpectationKind kind, const std::string& text) {
    ExpectationSpec one;
    one.kind = kind;
    one.name = "it";
    one.text = text;
    return one;
  }
  /// `count` cycles in which controllers run, from cycle 10, each made by `make`.
  ExpectationResult run(const ExpectationSpec& of, std::uint64_t count, const Cycle& make) {
    auto all = Expectations::read({&of, 1}, "file", names());
    EXPECT_TRUE(all) << all.error().front().to_string();
    if (!all) return {};
    phase = hal::RunPhase::kBringUp;
    state.torque_Nm()[0] = 1e9;  // before the controllers start it is nobody's business
    (*all)->take(view());
    phase = hal::RunPhase::kRunning;
    for (std::uint64_t i = 0; i < count; ++i) {
      at(10 + i);
      make(i);
      (*all)->take(view());
    }
    phase = hal::RunPhase::kShutDown;
    state.torque_Nm()[0] = 1e9;
    at(10 + count);
    (*all)->take(view());
    phase = hal::RunPhase::kRunning;
    so_far = (*all)->so_far().front();
    return (*all)->results().front();
  }
  ExpectationResult so_far;  // of the last run(), had it gone on
  /// Torques of the knee, a cycle each.
  ExpectationResult run(const ExpectationSpec& of, const std::vector<double>& torques) {
    return run(of, torques.size(), [&](std::uint64_t i) { state.torque_Nm()[0] = torques[i]; });
  }
};

TEST_F(ExpectationTest, AlwaysHasTheMarginOfTheWorstCycle) {
  const auto spec_of = spec(ExpectationKind::kAlways, "torque(knee) < 40Nm");
  const ExpectationResult good = run(spec_of, {1, 30, 38.5, 2});
  EXPECT_TRUE(good.passed) << good.reason;
  EXPECT_EQ(good.margin, 1.5);
  EXPECT_EQ(good.unit, "Nm");
  EXPECT_EQ(good.at_s, 0.012);
  const ExpectationResult bad = run(spec_of, {1, 43, 38, 41});
  EXPECT_FALSE(bad.passed);
  EXPECT_EQ(bad.margin, -3.0);
  EXPECT_EQ(bad.at_s, 0.011);
  EXPECT_EQ(bad.reason, "it did not hold in 2 of 4 cycles");
  EXPECT_FALSE(run(spec_of, {40, 1}).passed) << "less is less";
}

TEST_F(ExpectationTest, NeverIsItsOpposite) {
  const auto of = spec(ExpectationKind::kNever, "torque(knee) > 40Nm");
  EXPECT_EQ(run(of, {1, 38}).margin, 2.0);
  EXPECT_TRUE(run(of, {1, 38}).passed);
  EXPECT_FALSE(run(of, {1, 41}).passed);
  EXPECT_EQ(run(of, {1, 41}).margin, -1.0);
  EXPECT_EQ(run(of, {1, 41, 42}).reason, "it held in 2 of 3 cycles");
}

TEST_F(ExpectationTest, EventuallyHasTheBestCycle) {
  const auto of = spec(ExpectationKind::kEventually, "torque(knee) > 40Nm");
  EXPECT_TRUE(run(of, {1, 45, 42}).passed);
  EXPECT_EQ(run(of, {1, 45, 42}).margin, 5.0);
  EXPECT_EQ(run(of, {1, 45, 42}).at_s, 0.011);
  const ExpectationResult bad = run(of, {1, 39, 2});
  EXPECT_FALSE(bad.passed);
  EXPECT_EQ(bad.margin, -1.0);
  EXPECT_EQ(bad.reason, "it never held");
  EXPECT_TRUE(run(of, {kUnmeasured, 45}).passed) << "it held where it was known";
}

TEST_F(ExpectationTest, NumbersHaveBounds) {
  auto of = spec(ExpectationKind::kBounds, "torque(knee)");
  of.above = "1Nm";
  of.below = "10Nm";
  EXPECT_EQ(run(of, {3, 9, 5}).margin, 1.0);
  EXPECT_TRUE(run(of, {1, 10}).passed);
  EXPECT_EQ(run(of, {3, 0.5, 5}).margin, -0.5);
  EXPECT_FALSE(run(of, {3, 0.5, 5}).passed);
  of.kind = ExpectationKind::kFinal;
  EXPECT_TRUE(run(of, {99, 4}).passed);
  EXPECT_EQ(run(of, {99, 4}).margin, 3.0);
  EXPECT_EQ(run(of, {4, 12}).reason, "it is 12 Nm");
  of.kind = ExpectationKind::kMean;
  EXPECT_EQ(run(of, {2, 4, 6}).margin, 3.0);
  of.kind = ExpectationKind::kRms;
  EXPECT_EQ(run(of, {3, 4, 5, 5, 5, 5}).margin, std::sqrt(125.0 / 6.0) - 1.0);
  EXPECT_FALSE(run(of, {14.0, -14.0}).passed);
}

TEST_F(ExpectationTest, WorkIsWhatDrivesDidWhileTheyDrove) {
  auto of = spec(ExpectationKind::kWork, "knee");
  of.above = "1mJ";
  of.below = "50mJ";
  const auto cycle = [this](std::uint64_t i) {
    state.torque_Nm()[0] = 2.0;
    state.velocity_rad_s()[0] = i == 1 ? -4.0 : 4.0;  // in one cycle it brakes
    state.torque_Nm()[1] = -5.0;
    state.velocity_rad_s()[1] = -2.0;
  };
  const ExpectationResult good = run(of, 3, cycle);
  EXPECT_TRUE(good.passed) << good.reason;
  EXPECT_NEAR(*good.margin, 0.016 - 0.001, 1e-15) << "2 Nm at 4 rad/s for 2 ms";
  EXPECT_EQ(good.unit, "J");
  EXPECT_EQ(good.at_s, 0.012) << "the end of its window";
  of.text = "*";
  EXPECT_NEAR(*run(of, 3, cycle).margin, 0.05 - (0.016 + 0.030), 1e-15) << "and 5 N at 2 m/s";
  of.below = "40mJ";
  EXPECT_EQ(run(of, 3, cycle).reason, "it is 0.046 J");
  const ExpectationResult unknown_once = run(of, 3, [&](std::uint64_t i) {
    cycle(i);
    if (i == 1) state.torque_Nm()[0] = kUnmeasured;
  });
  EXPECT_EQ(unknown_once.reason, "nobody measured it in 1 of 3 cycles, first at 0.011 s");
  of.text = "knie";
  const auto unknown = Expectation::read(of, names());
  ASSERT_FALSE(unknown);
  EXPECT_EQ(unknown.error().key, "work");
  EXPECT_NE(unknown.error().hint.find("knee"), std::string::npos) << unknown.error().hint;
  of.text = "*";
  of.below = "3Nm";
  EXPECT_FALSE(Expectation::read(of, names())) << "that is no energy";
}

TEST_F(ExpectationTest, SettlingIsTheTimeAfterTheLastCycleOutside) {
  auto of = spec(ExpectationKind::kSettles, "torque(knee)");
  of.below = "1Nm";
  of.in_s = 0.003;
  const ExpectationResult good = run(of, {5, 0.5, 2, 0.5, 0.5});
  EXPECT_TRUE(good.passed) << good.reason;
  EXPECT_NEAR(*good.margin, 0.0, 1e-12);
  EXPECT_EQ(good.unit, "s");
  EXPECT_EQ(good.at_s, 0.013);
  EXPECT_EQ(run(of, {5, 0.5, 2, 2, 0.5}).reason, "it took 0.004 s");
  EXPECT_NE(run(of, {5, 0.5, 2, 0.5, 2}).reason.find("outside at the end"), std::string::npos);
  EXPECT_NEAR(*run(of, {0, 0, 0}).margin, 0.003, 1e-12);
  EXPECT_TRUE(run(of, {0, 0, 0}).passed);
  const ExpectationResult cut = run(of, {0, 0});
  EXPECT_EQ(cut.reason, "the run ended 0.002 s after its window began");
  EXPECT_FALSE(cut.margin) << "it failed";
  EXPECT_NEAR(*so_far.margin, 0.003, 1e-12);
}

TEST_F(ExpectationTest, WindowsBeginWithTheControllersOrAnEvent) {
  auto of = spec(ExpectationKind::kAlways, "torque(knee) < 40Nm");
  of.from_s = 0.001;
  of.to_s = 0.002;
  EXPECT_TRUE(run(of, {99, 1, 2, 99}).passed) << "cycles 1 and 2 alone";
  EXPECT_FALSE(run(of, {1, 99, 2, 1}).passed);
  EXPECT_FALSE(run(of, {1, 1, 99, 1}).passed);
  of.after = "torque(knee) > 90Nm";
  EXPECT_TRUE(run(of, {1, 99, 2, 2, 99}).passed);
  EXPECT_FALSE(run(of, {1, 99, 2, 50, 99}).passed);
  EXPECT_NE(run(of, {1, 2, 3}).reason.find("'torque(knee) > 90Nm' never held"), std::string::npos);
}

TEST_F(ExpectationTest, AWindowThatIsNotReachedFails) {
  auto of = spec(ExpectationKind::kAlways, "torque(knee) < 40Nm");
  of.from_s = 0.01;
  const ExpectationResult before = run(of, {1, 2, 3});
  EXPECT_FALSE(before.passed);
  EXPECT_FALSE(before.margin);
  EXPECT_EQ(before.reason,
            "its window was never reached: it begins at 0.01 s, and the run ended at 0.002 s");
  EXPECT_EQ(before.awaits, "it begins at 0.01 s");
  EXPECT_FALSE(before.holds_so_far);
  of.from_s = 0.0;
  of.to_s = 0.01;
  const ExpectationResult cut = run(of, {1, 2, 3});
  EXPECT_EQ(cut.reason, "its window ends at 0.01 s, and the run ended at 0.002 s");
  EXPECT_FALSE(cut.margin) << "it failed";
  EXPECT_FALSE(cut.at_s);
  EXPECT_EQ(so_far.margin, 37.0);
  EXPECT_EQ(so_far.at_s, 0.012);
  of.to_s = 0.003;
  EXPECT_TRUE(run(of, {1, 2, 3}).passed) << "the third cycle lasts until then";
  of.to_s = 0.01;
  of.kind = ExpectationKind::kEventually;
  EXPECT_TRUE(run(of, {1, 2, 3}).passed) << "it has held";
  EXPECT_EQ(run(of, std::vector<double>{}).reason, "its controllers never started");
}

TEST_F(ExpectationTest, OneUnderWaySaysWhatMayStillCome) {
  auto of = spec(ExpectationKind::kAlways, "torque(knee) < 40Nm");
  of.to_s = 0.01;
  EXPECT_EQ(run(of, {1, 2, 3}).awaits, "its window ends at 0.01 s");
  EXPECT_TRUE(run(of, {1, 2, 3}).holds_so_far);
  EXPECT_EQ(run(of, {1, 99, 3}).awaits, "") << "it has failed";
  EXPECT_EQ(run(of, std::vector<double>{}).awaits, "its controllers have not started");
  of.after = "torque(knee) > 90Nm";
  EXPECT_EQ(run(of, {1, 2, 3}).awaits, "it begins once 'torque(knee) > 90Nm' holds");
  auto once = spec(ExpectationKind::kEventually, "torque(knee) > 40Nm");
  EXPECT_EQ(run(once, {1, 2}).awaits, "it has not held yet");
  once.to_s = 0.002;
  EXPECT_EQ(run(once, {1, 2, 3}).awaits, "") << "its window is over";
  auto settles = spec(ExpectationKind::kSettles, "torque(knee)");
  settles.below = "40Nm";
  settles.in_s = 0.003;
  EXPECT_EQ(run(settles, {99, 98}).awaits, "it has 0.002 s left to settle");
  EXPECT_EQ(run(settles, {99, 1}).awaits, "its window goes on");
  EXPECT_TRUE(run(settles, {99, 1}).holds_so_far);
  EXPECT_EQ(run(settles, {99, 98, 97, 96, 95}).awaits, "");
}

TEST_F(ExpectationTest, WhatNobodyMeasuredFails) {
  for (const ExpectationKind kind :
       {ExpectationKind::kAlways, ExpectationKind::kNever, ExpectationKind::kEventually}) {
    const auto of = spec(kind, "torque(knee) < 40Nm");
    const ExpectationResult never = run(of, {kUnmeasured, kUnmeasured});
    EXPECT_FALSE(never.passed);
    EXPECT_FALSE(never.margin);
    EXPECT_EQ(never.reason, "nobody measured it");
  }
  for (const ExpectationKind kind :
       {ExpectationKind::kBounds, ExpectationKind::kRms, ExpectationKind::kMean,
        ExpectationKind::kFinal, ExpectationKind::kSettles}) {
    auto of = spec(kind, "torque(knee)");
    of.below = "40Nm";
    of.in_s = 0.003;
    EXPECT_EQ(run(of, {kUnmeasured, kUnmeasured}).reason, "nobody measured it");
    const ExpectationResult partly = run(of, {1, kUnmeasured, 1});
    EXPECT_FALSE(partly.passed);
    EXPECT_EQ(partly.reason, "nobody measured it in 1 of 3 cycles, first at 0.011 s");
    EXPECT_FALSE(partly.margin);
  }
  auto signal = spec(ExpectationKind::kAlways, "squat.depth < 1m");
  block->depth[0] = 0.1;
  const ExpectationResult stopped = run(signal, 4, [&](std::uint64_t i) {
    if (i < 2) block->publish(time.cycle, time.time_ns);
  });
  EXPECT_FALSE(stopped.passed) << "its controller was stopped";
}

TEST_F(ExpectationTest, FaultsMustOrMustNotCome) {
  const auto bit = std::uint64_t{1} << static_cast<unsigned>(hal::FaultCause::kBoardSilent);
  const auto in_cycle = [&](std::uint64_t number) {
    return [this, bit, number](std::uint64_t i) { faults = i == number ? bit : 0; };
  };
  const auto must = spec(ExpectationKind::kEventually, "fault(board_silent)");
  const auto must_not = spec(ExpectationKind::kNever, "fault(any)");
  EXPECT_TRUE(run(must, 3, in_cycle(1)).passed);
  EXPECT_FALSE(run(must, 3, in_cycle(9)).passed);
  EXPECT_TRUE(run(must_not, 3, in_cycle(9)).passed);
  EXPECT_FALSE(run(must_not, 3, in_cycle(1)).passed);
  EXPECT_FALSE(run(must_not, 3, in_cycle(1)).margin) << "no number decides";
  EXPECT_FALSE(run(must_not, 3, in_cycle(9)).at_s);
  EXPECT_EQ(run(must_not, 3, in_cycle(1)).at_s, 0.011);
  EXPECT_EQ(Expectation::read(must, names())->awaited_faults(), bit);
  EXPECT_EQ(Expectation::read(must_not, names())->awaited_faults(), 0U);
}

TEST_F(ExpectationTest, AFaultThatEndsTheRunIsSeen) {
  const auto bit = std::uint64_t{1} << static_cast<unsigned>(hal::FaultCause::kTilted);
  const std::vector<ExpectationSpec> specs{
      spec(ExpectationKind::kNever, "fault(fell)"),
      spec(ExpectationKind::kEventually, "fault(tilted)"),
  };
  auto all = Expectations::read(specs, "file", names());
  ASSERT_TRUE(all);
  (*all)->take(view());
  phase = hal::RunPhase::kShutDown;
  faults = bit;
  at(11);
  (*all)->take(view());
  EXPECT_FALSE((*all)->results()[0].passed);
  EXPECT_TRUE((*all)->results()[1].passed);
  at(12);
  (*all)->take(view());
  EXPECT_EQ((*all)->results()[0].reason, "it held in 1 of 2 cycles") << "then it is over";
}

TEST_F(ExpectationTest, RefusesWithTheKeyOfItsRow) {
  const auto refusal = [this](const ExpectationSpec& of) {
    const auto all = Expectations::read({&of, 1}, "file.toml", names());
    return all ? std::string("it was taken") : all.error().front().to_string();
  };
  auto of = spec(ExpectationKind::kAlways, "torqe(knee) < 1Nm");
  of.line = 7;
  EXPECT_NE(refusal(of).find("file.toml:7: expect.always: "), std::string::npos) << refusal(of);
  of = spec(ExpectationKind::kAlways, "torque(knee) < 1Nm and height() > 1m");
  EXPECT_NE(refusal(of).find("a row [[expect]] for each unit"), std::string::npos);
  of = spec(ExpectationKind::kBounds, "torque(knee)");
  of.below = "3rad";
  of.below_line = 9;
  EXPECT_NE(refusal(of).find("file.toml:9: expect.below: "), std::string::npos) << refusal(of);
  of.below = "3Nm";
  of.above = "4Nm";
  EXPECT_NE(refusal(of).find("nothing is above 4Nm and below 3Nm"), std::string::npos);
  of = spec(ExpectationKind::kAlways, "cycle() >= 0");
  of.after = "fault(fel)";
  of.after_line = 11;
  EXPECT_NE(refusal(of).find("file.toml:11: expect.after: "), std::string::npos) << refusal(of);
  of = spec(ExpectationKind::kAlways, "tilt() < 60deg");
  of.stays_up = true;
  robot.floating_base = false;
  EXPECT_NE(refusal(of).find("cannot fall"), std::string::npos);
}

TEST_F(ExpectationTest, WithoutATruthItFailsAndTheRunGoesOn) {
  QuantityNames real = names();
  real.truth = nullptr;
  const auto of = spec(ExpectationKind::kAlways, "height() > 0.4m");
  auto one = Expectation::read(of, real);
  ASSERT_TRUE(one) << one.error().to_string();
  one->take(view());
  EXPECT_FALSE(one->verdict().passed);
  EXPECT_NE(one->verdict().reason.find("in simulation alone"), std::string::npos);
  EXPECT_FALSE(Expectation::read(spec(ExpectationKind::kAlways, "heigt() > 0.4m"), real));
}

TEST_F(ExpectationTest, IsSeenByAnotherThreadWhileCyclesGoOn) {
  const auto of = spec(ExpectationKind::kAlways, "torque(knee) < 40Nm");
  auto all = Expectations::read({&of, 1}, "file", names());
  ASSERT_TRUE(all);
  EXPECT_FALSE((*all)->look(std::chrono::milliseconds(1))) << "no cycle came";
  std::atomic<bool> seen{false};
  std::thread other([&] {
    const auto looked = (*all)->look(std::chrono::seconds(10));
    EXPECT_TRUE(looked && looked->front().passed);
    seen = true;
  });
  state.torque_Nm()[0] = 10.0;
  for (std::uint64_t cycle = 10; !seen; ++cycle) {
    at(cycle);
    (*all)->take(view());
    std::this_thread::yield();
  }
  other.join();
  EXPECT_EQ((*all)->results().front().margin, 30.0);
}

TEST_F(ExpectationTest, IsRewoundWithItsRun) {
  const auto of = spec(ExpectationKind::kAlways, "torque(knee) < 40Nm");
  auto all = Expectations::read({&of, 1}, "file", names());
  ASSERT_TRUE(all);
  state.torque_Nm()[0] = 10.0;
  (*all)->take(view());
  Archive save;
  (*all)->archive(save);
  state.torque_Nm()[0] = 90.0;
  (*all)->take(view());  // the same cycle once more
  EXPECT_TRUE((*all)->results().front().passed);
  at(11);
  state.torque_Nm()[0] = 90.0;
  (*all)->take(view());
  EXPECT_FALSE((*all)->results().front().passed);
  Archive back(save.bytes());
  (*all)->archive(back);
  EXPECT_TRUE((*all)->results().front().passed);
  EXPECT_EQ((*all)->results().front().margin, 30.0);
}

TEST_F(ExpectationTest, IsJudgedWithoutHeapAndLocks) {
  std::vector<ExpectationSpec> specs{spec(ExpectationKind::kAlways, "torque(knee) < 40Nm"),
                                     spec(ExpectationKind::kSettles, "height()"),
                                     spec(ExpectationKind::kWork, "*")};
  specs[0].after = "phase() == running";
  specs[1].name = "other";
  specs[1].above = "0m";
  specs[2].name = "work";
  specs[2].below = "1J";
  auto all = Expectations::read(specs, "file", names());
  ASSERT_TRUE(all);
  const rt::ScopedRealtime realtime;
  (*all)->take(view());
}

}  // namespace
}  // namespace tandem::runtime
