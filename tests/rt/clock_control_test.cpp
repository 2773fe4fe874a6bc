// Pause, resume, step and rate of simulated time, and the bell that wakes a loop that stands.
#include "rt/clock_control.hpp"

#include <cmath>
#include <thread>

#include "rt/clock.hpp"
#include "tests/rt/fake_clock.hpp"

namespace tandem::rt {
namespace {

constexpr std::int64_t kMs = 1'000'000;
constexpr std::int64_t kLong_ns = 60'000 * kMs;  // only ever waited for when something is broken

/// A loop of simulated time on a clock of the test's.
struct Simulated {
  explicit Simulated(double rate = 0.0, bool start_paused = false)
      : config{.period_ns = kMs, .rate = rate, .start_paused = start_paused} {}
  Tick cycle(std::int64_t work_ns) {
    const Tick tick = loop.wait();
    clock.now += work_ns;
    loop.finish();
    return tick;
  }

  CyclicLoopConfig config;
  FakeClock clock;
  Doorbell bell;
  ClockControl control{config, bell};
  CyclicLoop loop{config, clock, &control};
};

/// A loop on its own thread until its bell says that the run is to end.
struct Threaded {
  explicit Threaded(double rate = 0.0, bool start_paused = false, std::int64_t period_ns = kMs)
      : config{.period_ns = period_ns, .rate = rate, .start_paused = start_paused}, thread([this] {
          while (!bell.ended()) {
            (void)loop.wait();
            loop.finish();
            began.fetch_add(1);
          }
        }) {}
  ~Threaded() {
    bell.end();
    thread.join();
  }

  CyclicLoopConfig config;
  WallClock clock;
  Doorbell bell;
  ClockControl control{config, bell};
  CyclicLoop loop{config, clock, &control};
  std::atomic<std::uint64_t> began{0};
  std::thread thread;
};

std::string refusal(const Status& status) {
  return status ? "" : status.error().message + " | " + status.error().hint;
}

TEST(ClockControl, RunsExactlyTheCyclesOfAStep) {
  Threaded run(0.0, true);
  ASSERT_TRUE(run.control.await_standing(kLong_ns));
  EXPECT_EQ(run.control.state().next_cycle, 0U);
  std::uint64_t expected = 0;
  for (const std::uint64_t n : {1, 1, 7, 100, 3}) {
    ASSERT_TRUE(run.control.step(n));
    ASSERT_TRUE(run.control.await_standing(kLong_ns));
    expected += n;
    const ClockState state = run.control.state();
    EXPECT_TRUE(state.paused);
    EXPECT_EQ(state.pending_steps, 0U);
    EXPECT_EQ(state.next_cycle, expected);
    EXPECT_EQ(run.began.load(), expected);
  }
}

TEST(ClockControl, StandsFromAPauseToAResume) {
  Threaded run;
  for (int i = 0; i < 20; ++i) {
    ASSERT_TRUE(run.control.pause());
    ASSERT_TRUE(run.control.await_standing(kLong_ns));
    const std::uint64_t stands_at = run.control.state().next_cycle;
    EXPECT_EQ(run.began.load(), stands_at);
    ASSERT_TRUE(run.control.pause());  // nothing to do is no error
    std::this_thread::yield();
    EXPECT_EQ(run.began.load(), stands_at);
    ASSERT_TRUE(run.control.resume());
    while (run.began.load() == stands_at) std::this_thread::yield();
  }
}

TEST(ClockControl, KeepsALoopThatStandsWhileSomebodyLooks) {
  Threaded run(0.0, true);
  ASSERT_TRUE(run.control.await_standing(kLong_ns));
  std::thread other;
  const bool stood = run.control.while_standing([&] {
    other = std::thread([&] { EXPECT_TRUE(run.control.resume()); });
    run.bell.ring();  // the loop wakes, and waits for this to end
    for (int i = 0; i < 1000; ++i) std::this_thread::yield();
    EXPECT_EQ(run.began.load(), 0U);
  });
  EXPECT_TRUE(stood);
  other.join();
  while (run.began.load() == 0) std::this_thread::yield();
  EXPECT_FALSE(run.control.while_standing([] { ADD_FAILURE() << "time goes on"; }));
}

TEST(ClockControl, RefusesAStepWhileTimeIsRunning) {
  Simulated run;
  EXPECT_EQ(refusal(run.control.step(1)), "time is running | pause it first: tandem clock pause");
  ASSERT_TRUE(run.control.pause());
  for (const std::uint64_t n : {std::uint64_t{0}, kMostSteps + 1, ~std::uint64_t{0}}) {
    EXPECT_NE(refusal(run.control.step(n)).find("1 to 1000000000 cycles"), std::string::npos);
  }
  EXPECT_EQ(run.control.state().pending_steps, 0U);
}

TEST(ClockControl, APauseDropsTheStepsThatHaveNotBegun) {
  Simulated run(0.0, true);
  ASSERT_TRUE(run.control.step(5));
  ASSERT_TRUE(run.control.step(5));
  for (int i = 0; i < 3; ++i) run.cycle(0);
  const auto dropped = run.control.pause();
  ASSERT_TRUE(dropped);
  EXPECT_EQ(*dropped, 7U);
}

TEST(ClockControl, TakesRatesFromAHundredthToAThousandAndZero) {
  Simulated run;
  for (const double rate : {0.0, 0.01, 1.0, 1000.0}) {
    ASSERT_TRUE(run.control.set_rate(rate)) << rate;
    EXPECT_EQ(run.control.state().rate, rate);
  }
  for (const double rate : {0.0099, 1000.1, -1.0, std::nan(""), HUGE_VAL}) {
    EXPECT_NE(refusal(run.control.set_rate(rate)).find("from 0.01 to 1000"), std::string::npos);
  }
  EXPECT_EQ(run.control.state().rate, 1000.0);
}

TEST(ClockControl, RefusesEverythingInRealTime) {
  for (const Pacing pacing : {Pacing::kWallClock, Pacing::kExternal}) {
    Doorbell bell;
    ClockControl control({.pacing = pacing, .start_paused = true}, bell);
    const char* reason = pacing == Pacing::kWallClock ? "real time" : "a bus";
    EXPECT_FALSE(control.state().paused);
    EXPECT_NE(control.pause().error().message.find(reason), std::string::npos);
    EXPECT_NE(refusal(control.resume()).find(reason), std::string::npos);
    EXPECT_NE(refusal(control.step(1)).find(reason), std::string::npos);
    EXPECT_NE(refusal(control.set_rate(1.0)).find(reason), std::string::npos);
  }
}

TEST(ClockControl, ALoopInRealTimeObeysNoControl) {
  FakeClock clock;
  Doorbell bell;
  const CyclicLoopConfig simulated{.period_ns = kMs, .start_paused = true};
  ClockControl control(simulated, bell);
  CyclicLoop loop({.period_ns = kMs, .pacing = Pacing::kWallClock}, clock, &control);
  for (std::uint64_t i = 0; i < 3; ++i) EXPECT_EQ(loop.wait().cycle, i);
}

TEST(ClockControl, APauseIsNeitherAnOverrunNorMadeGood) {
  Simulated run(1.0);
  for (int i = 0; i < 3; ++i) run.cycle(0);
  ASSERT_TRUE(run.control.pause());
  ASSERT_TRUE(run.control.step(1));
  run.cycle(0);
  run.bell.ring();  // as another request, which changes nothing
  ASSERT_TRUE(run.control.step(1));
  std::thread resumes([&] {
    if (run.control.await_standing(kLong_ns)) (void)run.control.resume();
  });
  run.cycle(0);
  run.clock.now += 10'000 * kMs;  // paused for 10 s
  const std::int64_t resumed_ns = run.clock.now;
  Tick tick = run.cycle(0);
  resumes.join();
  EXPECT_FALSE(tick.late);
  EXPECT_EQ(tick.cycle, 5U);
  EXPECT_EQ(tick.begin_ns, resumed_ns);  // at once, then one period after the other
  for (int i = 1; i < 4; ++i) {
    tick = run.cycle(0);
    EXPECT_EQ(tick.begin_ns, resumed_ns + i * kMs);
  }
  EXPECT_EQ(run.loop.statistics().overruns, 0U);
}

TEST(ClockControl, AnotherRateFollowsFromTheLastGridPoint) {
  Simulated run(1.0);
  const std::int64_t start_ns = run.clock.now;
  for (int i = 0; i < 3; ++i) run.cycle(kMs / 4);  // the last at start + 2 ms
  ASSERT_TRUE(run.control.set_rate(0.5));
  EXPECT_EQ(run.cycle(kMs / 4).begin_ns, start_ns + 4 * kMs);
  ASSERT_TRUE(run.control.set_rate(2.0));
  EXPECT_EQ(run.cycle(kMs / 4).begin_ns, start_ns + 4 * kMs + kMs / 2);
  EXPECT_EQ(run.cycle(kMs / 4).begin_ns, start_ns + 5 * kMs);
  // What would have passed long ago at the new rate is now.
  ASSERT_TRUE(run.control.set_rate(1000.0));
  const std::int64_t now_ns = run.clock.now;
  EXPECT_EQ(run.cycle(0).begin_ns, now_ns);
  ASSERT_TRUE(run.control.set_rate(0.0));
  EXPECT_EQ(run.cycle(5 * kMs).begin_ns, now_ns);
  ASSERT_TRUE(run.control.set_rate(1.0));
  EXPECT_EQ(run.cycle(0).begin_ns, now_ns + 5 * kMs);
  EXPECT_EQ(run.cycle(0).begin_ns, now_ns + 6 * kMs);
  EXPECT_EQ(run.loop.statistics().overruns, 0U);
}

TEST(ClockControl, AnotherRateWakesALoopThatSleepsForItsCycle) {
  Threaded run(0.01, false, 1'000'000 * kMs);  // 28 hours from cycle to cycle
  while (run.began.load() < 1) std::this_thread::yield();
  ASSERT_TRUE(run.control.set_rate(0.0));
  while (run.began.load() < 100) std::this_thread::yield();
  ASSERT_TRUE(run.control.set_rate(0.01));
  ASSERT_TRUE(run.control.pause());  // and so does a pause, and the end
  EXPECT_TRUE(run.control.await_standing(kLong_ns));
  ASSERT_TRUE(run.control.resume());
}

TEST(ClockControl, MeasuresFromWhereTimeWentOnLast) {
  Simulated run(1.0);
  run.cycle(0);
  EXPECT_EQ(run.control.state().since_ns, run.clock.now);
  run.cycle(0);
  run.cycle(0);
  EXPECT_EQ(run.control.state().since_cycle, 0U);
  ASSERT_TRUE(run.control.set_rate(2.0));
  run.cycle(0);
  EXPECT_EQ(run.control.state().since_cycle, 3U);
}

TEST(ClockControl, ARunThatIsAskedToEndIsNotKept) {
  Simulated run(0.01, true);
  std::thread ends([&] {
    if (run.control.await_standing(kLong_ns)) run.bell.end();
  });
  EXPECT_EQ(run.loop.wait().cycle, 0U);
  ends.join();
  EXPECT_EQ(run.loop.wait().cycle, 1U);
  EXPECT_TRUE(run.clock.sleeps.empty());
  EXPECT_EQ(run.control.state().rate, 0.0);
  EXPECT_FALSE(run.control.state().paused);
  for (const Status& asked : {run.control.resume(), run.control.step(1), run.control.set_rate(1)}) {
    EXPECT_NE(refusal(asked).find("the run is ending"), std::string::npos);
  }
  EXPECT_FALSE(run.control.pause());
  EXPECT_EQ(run.loop.wait().cycle, 2U);
}

TEST(ClockControl, AStopSignalIsNoticedWhileTheLoopStands) {
  Simulated run(0.0, true);
  std::thread stops([&] {
    if (run.control.await_standing(kLong_ns)) request_stop();
  });
  EXPECT_EQ(run.loop.wait().cycle, 0U);
  stops.join();
  clear_stop();
}

TEST(ClockControl, OtherRequestsLeaveTheLoopWhereItStands) {
  Threaded run(0.0, true);
  for (int i = 0; i < 100; ++i) run.bell.ring();
  ASSERT_TRUE(run.control.await_standing(kLong_ns));
  EXPECT_EQ(run.began.load(), 0U);
}

TEST(Doorbell, DoesNotMissARingBetweenTheLookAndTheWait) {
  Doorbell bell;
  const std::uint32_t seen = bell.count();
  bell.ring();
  bell.wait(seen);  // returns at once, or never
  EXPECT_EQ(bell.count(), seen + 1);
}

TEST(Doorbell, GivesUpAtTheDeadline) {
  WallClock clock;
  const Doorbell bell;
  for (const std::int64_t wait_ns : {std::int64_t{0}, kMs, 45 * kMs}) {
    const std::int64_t deadline_ns = clock.now_ns() + wait_ns;
    bell.wait(bell.count(), deadline_ns);
    EXPECT_GE(clock.now_ns(), deadline_ns);
  }
}

TEST(Doorbell, WithoutADeadlineWaitsForTheRing) {
  Doorbell bell;
  std::atomic<bool> rung{false}, early{false};
  const std::uint32_t seen = bell.count();
  std::thread waits([&] {
    bell.wait(seen);
    early.store(!rung.load());
  });
  std::this_thread::sleep_for(std::chrono::milliseconds(50));
  rung.store(true);
  bell.ring();
  waits.join();
  EXPECT_FALSE(early.load());
}

TEST(Doorbell, WakesWhoeverWaitsUntilTheEnd) {
  Doorbell bell;
  std::atomic<std::uint32_t> heard{0};
  std::thread waits([&] {
    while (!bell.ended()) {
      const std::uint32_t seen = bell.count();
      heard.store(seen);
      if (!bell.ended()) bell.wait(seen);
    }
  });
  for (std::uint32_t i = 1; i <= 100; ++i) {
    bell.ring();
    while (heard.load() < i) std::this_thread::yield();
  }
  bell.end();
  waits.join();
}

}  // namespace
}  // namespace tandem::rt
