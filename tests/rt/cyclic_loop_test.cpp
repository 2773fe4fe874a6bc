#include "rt/cyclic_loop.hpp"

#include "base/archive.hpp"
#include "rt/scoped_realtime.hpp"
#include "tests/rt/fake_clock.hpp"

namespace tandem::rt {
namespace {

constexpr std::int64_t kMs_ns = 1'000'000;
constexpr std::int64_t kStart = 1'000'000'000;

CyclicLoopConfig wall(OverrunPolicy policy = OverrunPolicy::kSkip) {
  return {.period_ns = kMs_ns, .pacing = Pacing::kWallClock, .on_overrun = policy};
}

/// One cycle whose work takes `work_ns`.
Tick cycle(CyclicLoop& loop, FakeClock& clock, std::int64_t work_ns) {
  const Tick tick = loop.wait();
  clock.now += work_ns;
  loop.finish();
  return tick;
}

TEST(CyclicLoop, StartsEachCycleAtAnAbsoluteGridPoint) {
  FakeClock clock;
  clock.wakeup_latency_ns = 40'000;
  CyclicLoop loop(wall(), clock);
  for (int i = 0; i < 4; ++i) cycle(loop, clock, 200'000);
  EXPECT_EQ(clock.sleeps,
            (std::vector<std::int64_t>{kStart + kMs_ns, kStart + 2 * kMs_ns, kStart + 3 * kMs_ns}));
  EXPECT_EQ(loop.statistics().wakeup.max_ns(), 40'000);
  EXPECT_EQ(loop.statistics().wakeup.count(), 3U);
  EXPECT_EQ(loop.statistics().work.max_ns(), 200'000);
  EXPECT_EQ(loop.statistics().overruns, 0U);
}

TEST(CyclicLoop, ShiftsItsGridALittleAtATime) {
  FakeClock clock;
  CyclicLoop loop(wall(), clock);
  loop.shift(5000);  // before the grid has begun
  cycle(loop, clock, 200'000);
  loop.shift(3000);
  cycle(loop, clock, 200'000);
  loop.shift(-1'000'000);
  cycle(loop, clock, 200'000);
  cycle(loop, clock, 200'000);
  EXPECT_EQ(clock.sleeps,
            (std::vector<std::int64_t>{kStart + kMs_ns + 3000, kStart + 2 * kMs_ns + 3000 - 10'000,
                                       kStart + 3 * kMs_ns + 3000 - 10'000}));
  CyclicLoop free({.period_ns = kMs_ns, .pacing = Pacing::kSimulated}, clock);
  cycle(free, clock, 200'000);
  free.shift(5000);
  EXPECT_EQ(cycle(free, clock, 0).time_ns, kMs_ns);
}

TEST(CyclicLoop, SkipsToTheNextGridPointAfterAnOverrunAndKeepsItsPhase) {
  FakeClock clock;
  CyclicLoop loop(wall(), clock);
  cycle(loop, clock, 2'300'000);  // over the grid points 1 and 2
  const Tick tick = cycle(loop, clock, 100'000);
  EXPECT_TRUE(tick.late);
  EXPECT_FALSE(tick.hold);
  EXPECT_EQ(tick.skipped, 2U);
  EXPECT_EQ(tick.cycle, 3U);
  EXPECT_EQ(tick.time_ns, 3 * kMs_ns);
  EXPECT_EQ(clock.sleeps.back(), kStart + 3 * kMs_ns);
  const Tick after = cycle(loop, clock, 100'000);
  EXPECT_FALSE(after.late);
  EXPECT_EQ(after.cycle, 4U);
  EXPECT_EQ(clock.sleeps.back(), kStart + 4 * kMs_ns);
  EXPECT_EQ(loop.statistics().overruns, 1U);
  EXPECT_EQ(loop.statistics().skipped, 2U);
  EXPECT_EQ(loop.statistics().cycles, 3U);
}

TEST(CyclicLoop, AsksToHoldOnlyInTheCycleAfterAnOverrun) {
  FakeClock clock;
  CyclicLoop loop(wall(OverrunPolicy::kHold), clock);
  cycle(loop, clock, 1'100'000);
  EXPECT_TRUE(cycle(loop, clock, 100'000).hold);
  EXPECT_FALSE(cycle(loop, clock, 100'000).hold);
}

TEST(CyclicLoop, AsksToStopOnceTooManyOfTheLastCyclesWereLate) {
  FakeClock clock;
  CyclicLoopConfig config = wall(OverrunPolicy::kStop);
  config.stop_late = 3;
  config.stop_window = 5;
  CyclicLoop loop(config, clock);
  cycle(loop, clock, 1'100'000);
  EXPECT_FALSE(cycle(loop, clock, 1'100'000).stop);  // 1 late
  EXPECT_FALSE(cycle(loop, clock, 0).stop);          // 2 late
  EXPECT_FALSE(cycle(loop, clock, 0).stop);          // on time
  EXPECT_FALSE(cycle(loop, clock, 1'100'000).stop);  // on time
  EXPECT_TRUE(cycle(loop, clock, 0).stop);           // the third of the last five
}

TEST(CyclicLoop, ForgetsLateCyclesThatLeftTheWindow) {
  FakeClock clock;
  CyclicLoopConfig config = wall(OverrunPolicy::kStop);
  config.stop_late = 2;
  config.stop_window = 3;
  CyclicLoop loop(config, clock);
  cycle(loop, clock, 1'100'000);
  EXPECT_FALSE(cycle(loop, clock, 0).stop);
  for (int i = 0; i < 2; ++i) EXPECT_FALSE(cycle(loop, clock, 0).stop);
  cycle(loop, clock, 1'100'000);
  EXPECT_FALSE(cycle(loop, clock, 0).stop);
}

TEST(CyclicLoop, NeverSleepsWhenSimulatedTimeRunsFree) {
  FakeClock clock;
  CyclicLoop loop({.period_ns = kMs_ns, .pacing = Pacing::kSimulated, .rate = 0.0}, clock);
  for (std::uint64_t k = 0; k < 1000; ++k) {
    const Tick tick = cycle(loop, clock, 5 * kMs_ns);
    EXPECT_EQ(tick.cycle, k);
    EXPECT_EQ(tick.time_ns, static_cast<std::int64_t>(k) * kMs_ns);
    EXPECT_FALSE(tick.late);
  }
  EXPECT_TRUE(clock.sleeps.empty());
  EXPECT_EQ(loop.statistics().overruns, 0U);
}

TEST(CyclicLoop, ScalesSimulatedTimeByTheRate) {
  FakeClock clock;
  CyclicLoop loop({.period_ns = kMs_ns, .pacing = Pacing::kSimulated, .rate = 5.0}, clock);
  for (int i = 0; i < 3; ++i) cycle(loop, clock, 50'000);
  EXPECT_EQ(clock.sleeps, (std::vector<std::int64_t>{kStart + 200'000, kStart + 400'000}));
}

TEST(CyclicLoop, NeverMissesACycleOfSimulatedTimeHoweverLate) {
  FakeClock clock;
  CyclicLoopConfig config{.period_ns = kMs_ns, .pacing = Pacing::kSimulated, .rate = 1.0};
  config.on_overrun = OverrunPolicy::kStop;
  config.stop_late = 1;
  CyclicLoop loop(config, clock);
  for (std::uint64_t k = 0; k < 10; ++k) {
    const Tick tick = cycle(loop, clock, 3'500'000);
    EXPECT_EQ(tick.cycle, k);
    EXPECT_FALSE(tick.hold || tick.stop);
  }
  EXPECT_EQ(loop.statistics().overruns, 9U);
  EXPECT_EQ(loop.statistics().skipped, 0U);
  EXPECT_TRUE(clock.sleeps.empty()) << "a rate that is too fast is no slower than a free run";
  EXPECT_EQ(clock.now, kStart + 10 * 3'500'000);
}

TEST(CyclicLoop, MakesGoodAMillisecondOfSimulatedTimeAndNoMore) {
  FakeClock clock;
  CyclicLoop loop({.period_ns = kMs_ns, .pacing = Pacing::kSimulated, .rate = 1.0}, clock);
  cycle(loop, clock, kMs_ns + 900'000);
  EXPECT_EQ(cycle(loop, clock, 0).begin_ns, kStart + kMs_ns + 900'000);
  EXPECT_EQ(cycle(loop, clock, 0).begin_ns, kStart + 2 * kMs_ns) << "on its grid again";
  EXPECT_EQ(cycle(loop, clock, 12 * kMs_ns).begin_ns, kStart + 3 * kMs_ns);
  EXPECT_EQ(cycle(loop, clock, 0).begin_ns, kStart + 15 * kMs_ns);
  EXPECT_EQ(cycle(loop, clock, 0).begin_ns, kStart + 15 * kMs_ns) << "the millisecond";
  EXPECT_EQ(cycle(loop, clock, 0).begin_ns, kStart + 16 * kMs_ns);
  EXPECT_EQ(loop.statistics().overruns, 2U);
}

TEST(CyclicLoop, LeavesThePaceToABus) {
  FakeClock clock;
  CyclicLoop loop({.period_ns = kMs_ns, .pacing = Pacing::kExternal}, clock);
  for (int i = 0; i < 5; ++i) cycle(loop, clock, 3 * kMs_ns);
  EXPECT_TRUE(clock.sleeps.empty());
  EXPECT_EQ(loop.next_cycle(), 5U);
}

TEST(CyclicLoop, GoesOnAtTheArchivedCycle) {
  FakeClock clock;
  CyclicLoop loop({.period_ns = kMs_ns, .pacing = Pacing::kSimulated}, clock);
  for (int i = 0; i < 7; ++i) cycle(loop, clock, 0);
  Archive saved;
  loop.archive(saved);
  for (int i = 0; i < 5; ++i) cycle(loop, clock, 0);
  Archive again(saved.bytes());
  loop.archive(again);
  EXPECT_TRUE(again.ok() && again.at_end());
  EXPECT_EQ(cycle(loop, clock, 0).time_ns, 7 * kMs_ns);
}

TEST(CyclicLoop, RunsOnTheWallClockWithoutLosingCycles) {
  WallClock clock;
  CyclicLoop loop(wall(), clock);
  const std::int64_t begin = clock.now_ns();
  std::uint64_t last = 0;
  for (int i = 0; i < 50; ++i) {
    const Tick tick = loop.wait();
    const ScopedRealtime in_cycle;
    last = tick.cycle;
    loop.finish();
  }
  // Each cycle is either run or counted as skipped, and none starts before its time.
  EXPECT_EQ(last + 1, 50U + loop.statistics().skipped);
  EXPECT_GE(clock.now_ns() - begin, static_cast<std::int64_t>(last) * kMs_ns);
}

}  // namespace
}  // namespace tandem::rt
