// The stages' clock times of a run, and the trace file made of them.
#include "runtime/cycle_trace.hpp"

#include <fstream>
#include <map>
#include <nlohmann/json.hpp>

#include "runtime/trace_file.hpp"
#include "tests/log/scratch_folder.hpp"
#include "tests/runtime/loop_run.hpp"
#include "tests/support/rt_trap.hpp"

// Linked with the real-time trap: a cycle that allocates, locks or blocks fails its test.

namespace tandem::runtime {
namespace {

using Json = nlohmann::json;

/// Ticks a little with every look at it, so that no two stamps are equal.
class TickingClock final : public rt::Clock {
 public:
  std::int64_t now = 1'000'000'000;
  std::int64_t now_ns() noexcept TANDEM_RT override { return now += 1'234; }
  void sleep_until(std::int64_t deadline_ns) noexcept override {
    now = std::max(now, deadline_ns + 40'000);
  }
};

/// A robot behind a bus whose answers take 200 us.
class BusRobot final : public test::FirstOrderRobot {
 public:
  BusRobot(const hal::RobotConfig& robot, TickingClock& clock)
      : FirstOrderRobot(robot), clock_(&clock) {}
  [[nodiscard]] bool waits_for_bus() const noexcept override { return waits; }
  void exchange(const hal::CycleTime&) noexcept override {
    if (waits) clock_->now += 200'000;
  }
  bool waits = true;

 private:
  TickingClock* clock_;
};

class TracedRun : public testing::Test, protected test::LoopRun {
 protected:
  TracedRun() : LoopRun(hal::test::fake_robot()) { clock = &ticking; }
  void make(CycleConfig config, bool waits = true) {
    backend.waits = waits;
    config.running_cycles = 100;
    config.loop.pacing = rt::Pacing::kWallClock;
    begin(backend, config);
  }
  Json written() {
    const std::string file = folder / "trace.json";
    const Status status =
        write_trace(file, "three \"joints\"", cycle->trace(), cycle->faults(), *host->names());
    EXPECT_TRUE(status) << status.error().to_string();
    std::ifstream in(file);
    return Json::parse(in, nullptr, false);
  }
  /// Events of one phase ("X", "i", "C"), in the order of the file.
  static std::vector<Json> events(const Json& trace, const std::string& phase) {
    std::vector<Json> found;
    for (const Json& event : trace["traceEvents"]) {
      if (event["ph"] == phase) found.push_back(event);
    }
    return found;
  }

  const log::ScratchFolder folder;
  TickingClock ticking;
  BusRobot backend{robot, ticking};
};

TEST_F(TracedRun, KeepsTheLastCyclesWithTheirStagesInOrder) {
  make({.trace_cycles = 50});
  cycle->run();
  const std::uint64_t all = cycle->loop().cycles;
  EXPECT_EQ(cycle->trace().count(), all);
  const auto cycles = cycle->trace().cycles();
  ASSERT_EQ(cycles.size(), 50U);
  std::int64_t before_ns = cycles.front().begin_ns;
  for (std::size_t i = 0; i < cycles.size(); ++i) {
    EXPECT_EQ(cycles[i].cycle, all - 50 + i);
    EXPECT_EQ(cycles[i].begin_ns, before_ns);  // a cycle begins where the last one ended
    for (std::size_t s = 0; s < kCycleStages; ++s) {
      EXPECT_GT(cycles[i].stage_ns(static_cast<CycleStage>(s)), 0) << s;
    }
    before_ns = cycles[i].end_ns.back();
  }
}

TEST_F(TracedRun, SplitsTheCycleIntoWakeUpBusAndWork) {
  make({.trace_cycles = 1000});
  cycle->run();
  const auto cycles = cycle->trace().cycles();
  const rt::CycleStatistics& loop = cycle->loop();
  ASSERT_EQ(cycles.size(), loop.cycles);
  std::int64_t bus_ns = 0, work_ns = 0, wakeup_ns = 0;
  for (const CycleStamps& stamps : cycles) {
    bus_ns += stamps.stage_ns(CycleStage::kExchange);
    work_ns += stamps.end_ns.back() - stamps.end_ns[1];
    if (stamps.wakeup_ns >= 0) wakeup_ns += stamps.wakeup_ns;
    EXPECT_GE(stamps.stage_ns(CycleStage::kExchange), 200'000);
    EXPECT_LT(stamps.end_ns.back() - stamps.end_ns[1], 200'000);
  }
  EXPECT_EQ(bus_ns, loop.bus.sum_ns());
  EXPECT_EQ(work_ns, loop.work.sum_ns());
  EXPECT_EQ(wakeup_ns, loop.wakeup.sum_ns());
  EXPECT_EQ(loop.bus.count(), loop.cycles);
}

TEST_F(TracedRun, HasNoBusTimeWithoutABus) {
  make({.trace_cycles = 1000}, false);
  cycle->run();
  EXPECT_EQ(cycle->loop().bus.count(), 0U);
  for (const CycleStamps& stamps : cycle->trace().cycles()) {
    EXPECT_EQ(stamps.stage_ns(CycleStage::kExchange), 0);
  }
  for (const Json& span : events(written(), "X")) EXPECT_NE(span["name"], "exchange");
}

TEST_F(TracedRun, KeepsNothingUnasked) {
  make({});
  cycle->run();
  EXPECT_EQ(cycle->trace().count(), 0U);
  EXPECT_TRUE(cycle->trace().cycles().empty());
  EXPECT_TRUE(events(written(), "X").empty());
}

TEST_F(TracedRun, WritesSpansThatNestAndSumUp) {
  make({.trace_cycles = 40});
  cycle->run();
  const Json trace = written();
  ASSERT_FALSE(trace.is_discarded());
  EXPECT_EQ(trace["otherData"]["robot"], "three \"joints\"");
  EXPECT_EQ(trace["otherData"]["cycles"], 40);
  EXPECT_EQ(trace["otherData"]["cycles_before"], cycle->loop().cycles - 40);
  const std::vector<Json> spans = events(trace, "X");
  constexpr std::size_t kPerCycle = kCycleStages + 1;
  ASSERT_EQ(spans.size(), 40 * kPerCycle);
  const auto begin = [](const Json& span) { return span["ts"].get<double>(); };
  const auto end = [](const Json& span) {
    return span["ts"].get<double>() + span["dur"].get<double>();
  };
  const char* kNames[] = {"wait",   "cycle", "exchange", "read",     "check",
                          "update", "limit", "write",    "hand over"};
  double last_us = 0.0;
  for (std::size_t i = 0; i < spans.size(); i += kPerCycle) {
    for (std::size_t s = 0; s < kPerCycle; ++s) EXPECT_EQ(spans[i + s]["name"], kNames[s]);
    const Json& whole = spans[i + 1];
    EXPECT_NEAR(begin(spans[i]), last_us, 1e-6);           // the wait, from the last cycle's end
    EXPECT_NEAR(end(spans[i]), begin(whole), 1e-6);        // to this one's begin
    EXPECT_NEAR(begin(spans[i + 2]), begin(whole), 1e-6);  // which its first stage shares
    double sum_us = 0.0;
    for (std::size_t s = 2; s < kPerCycle; ++s) {
      if (s > 2) {
        EXPECT_NEAR(begin(spans[i + s]), end(spans[i + s - 1]), 1e-6);
      }
      sum_us += spans[i + s]["dur"].get<double>();
    }
    EXPECT_NEAR(sum_us, whole["dur"].get<double>(), 1e-6);
    EXPECT_NEAR(end(spans[i + kPerCycle - 1]), end(whole), 1e-6);
    last_us = end(whole);
  }
}

TEST_F(TracedRun, CountsWakeUpLatencyAndWorkPerCycle) {
  make({.trace_cycles = 40});
  cycle->run();
  std::map<std::string, std::vector<double>> counters;
  for (const Json& event : events(written(), "C")) {
    counters[event["name"]].push_back(event["args"]["us"].get<double>());
    EXPECT_GE(counters[event["name"]].back(), 0.0);
  }
  EXPECT_EQ(counters["wake-up latency [us]"].size(), 40U);
  const std::vector<CycleStamps> cycles = cycle->trace().cycles();
  const std::vector<double>& work_us = counters["work [us]"];
  ASSERT_EQ(work_us.size(), cycles.size());
  for (std::size_t i = 0; i < cycles.size(); ++i) {  // all stages behind the exchange
    double sum_us = 0.0;
    for (std::size_t s = 2; s < kCycleStages; ++s) {
      sum_us += 1e-3 * static_cast<double>(cycles[i].stage_ns(static_cast<CycleStage>(s)));
    }
    EXPECT_NEAR(work_us[i], sum_us, 1e-6);
  }
}

TEST_F(TracedRun, MarksOverrunsAndFaults) {
  make({.trace_cycles = 1000});
  for (int i = 0; i < 60; ++i) (void)cycle->step();
  ticking.now += 2'500'000;
  (void)cycle->step();
  backend.faulted_joint = 1;
  cycle->run();
  std::vector<std::string> names;
  for (const Json& event : events(written(), "i")) names.push_back(event["name"]);
  ASSERT_EQ(names.size(), 2U);
  EXPECT_EQ(names[0], "overrun: 2 skipped");
  EXPECT_NE(names[1].find("fault: "), std::string::npos);
  EXPECT_NE(names[1].find("0x7310"), std::string::npos) << names[1];
}

/// Takes its time, on the loop's clock.
class Slow final : public test::Sine {
 public:
  Slow(std::size_t joint, TickingClock& clock) : Sine({joint}), clock_(&clock) {}
  Code update(const hal::CycleTime& time, const hal::StateImage& state,
              hal::CommandImage& command) noexcept override {
    clock_->now += takes_ns;
    return Sine::update(time, state, command);
  }
  std::int64_t takes_ns = 10'000;

 private:
  TickingClock* clock_;
};

// An overrun had nobody's name, whichever controller took the time.
TEST_F(TracedRun, TimesEachControllerAndNamesTheReasonOfAnOverrun) {
  const auto quick = std::make_shared<Slow>(0, ticking);
  const auto slow = std::make_shared<Slow>(1, ticking);
  slow->takes_ns = 50'000;
  add("quick", quick);
  add("slow", slow);
  make({.loop = {.on_overrun = rt::OverrunPolicy::kStop, .stop_late = 3, .stop_window = 10},
        .trace_cycles = 1000},
       false);
  until(RunPhase::kRunning);
  steps(30);
  const auto times = host->names()->all();
  EXPECT_GE(times[0]->calls.percentiles().p50, 10'000);
  EXPECT_LT(times[0]->calls.percentiles().p50, 20'000);
  EXPECT_GE(times[1]->calls.percentiles().p50, 50'000);
  ticking.now += 3'000'000;  // not by a controller
  steps(1);
  EXPECT_EQ(times[0]->overruns + times[1]->overruns, 0U);
  slow->takes_ns = 700'000;
  quick->takes_ns = 600'000;
  steps(1);
  slow->takes_ns = 50'000;
  quick->takes_ns = 10'000;
  steps(1);
  EXPECT_EQ(times[0]->overruns, 0U);
  EXPECT_EQ(times[1]->overruns, 1U);
  quick->takes_ns = 1'500'000;
  steps(1);
  (void)cycle->step();
  EXPECT_EQ(times[0]->overruns, 1U);
  ASSERT_EQ(cycle->faults().size(), 1U);
  EXPECT_EQ(cycle->faults()[0].controller, "quick");
  EXPECT_EQ(cycle->faults()[0].text,
            "3 of the last 10 cycles were late; in the last of them the controller 'quick' took "
            "longest");
  std::map<std::string, int> spans;
  for (const Json& span : events(written(), "X")) ++spans[span["name"]];
  EXPECT_EQ(spans["quick"], spans["slow"]);
  EXPECT_GT(spans["quick"], 30);
}

TEST_F(TracedRun, SaysWhichFileCannotBeWritten) {
  make({.trace_cycles = 4});
  const Status status =
      write_trace("/proc/nothing/trace.json", "r", cycle->trace(), {}, *host->names());
  ASSERT_FALSE(status);
  EXPECT_EQ(status.error().file, "/proc/nothing/trace.json");
  EXPECT_NE(status.error().message.find("No such file"), std::string::npos);
}

}  // namespace
}  // namespace tandem::runtime
