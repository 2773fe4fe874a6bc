// Where the time of a cycle goes: a squat as `tandem run` runs it, stage by stage, the stages of
// the simulation inside `read` as well; and what tracing the stages costs.
//   cycle_bench [EXPERIMENT]          (default: COMAN's squat)
//   cycle_bench EXPERIMENT --paced    one cycle per period of the wall clock, 15 s at most
// Times mean something on an idle machine only; the head says which one it was.
#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <numeric>
#include <vector>

#include "bench/rig.hpp"
#include "estimation/estimator.hpp"
#include "hal/config/capabilities.hpp"

namespace tandem::bench {
namespace {

/// Takes the time between the calls of SimRobot's hook.
struct SimStages {
  rt::WallClock clock;
  std::array<std::int64_t, sim::kSimStages> sum_ns{};
  std::int64_t last_ns = 0;

  static void hook(void* self, sim::SimStage finished) {
    auto* stages = static_cast<SimStages*>(self);
    const std::int64_t now_ns = stages->clock.now_ns();
    stages->sum_ns[static_cast<std::size_t>(finished)] += now_ns - stages->last_ns;
    stages->last_ns = now_ns;
  }
};

constexpr const char* kSimStageNames[sim::kSimStages] = {
    "master: SYNC", "plant", "sensors", "boards' firmware", "master: decode", "truth"};

void row(const std::string& name, std::int64_t sum_ns, std::uint64_t cycles,
         std::int64_t total_ns) {
  fmt::print("{:24} {:9.2f} {:8.1f} %\n", name,
             static_cast<double>(sum_ns) * 1e-3 / static_cast<double>(cycles),
             100.0 * static_cast<double>(sum_ns) / static_cast<double>(total_ns));
}

void print_stages(const runtime::RobotCycle& cycle, const SimStages& sim) {
  using runtime::CycleStage;
  std::array<std::int64_t, runtime::kCycleStages> sum_ns{};
  for (const runtime::CycleStamps& stamps : cycle.trace().cycles()) {
    for (std::size_t i = 1; i < sum_ns.size(); ++i) {
      sum_ns[i] += stamps.stage_ns(static_cast<CycleStage>(i));
    }
  }
  const std::uint64_t cycles = cycle.loop().cycles;
  const std::int64_t total_ns = std::accumulate(sum_ns.begin(), sum_ns.end(), std::int64_t{0});
  fmt::print("\n{:24} {:>9} {:>8}\n", "stage", "us/cycle", "share");
  for (std::size_t i = 2; i < sum_ns.size(); ++i) {  // it neither waits nor exchanges
    row(runtime::to_string(static_cast<CycleStage>(i)), sum_ns[i], cycles, total_ns);
    if (static_cast<CycleStage>(i) != CycleStage::kRead) continue;
    for (std::size_t s = 0; s < sim::kSimStages; ++s) {
      row(fmt::format("  {}", kSimStageNames[s]), sim.sum_ns[s], cycles, total_ns);
    }
  }
  row("all", total_ns, cycles, total_ns);
  std::int64_t own_ns = total_ns;  // what a robot on a wire leaves to this computer
  for (const sim::SimStage stage : {sim::SimStage::kPlant, sim::SimStage::kSense,
                                    sim::SimStage::kBoards, sim::SimStage::kTruth}) {
    own_ns -= sim.sum_ns[static_cast<std::size_t>(stage)];
  }
  row("all without the robot", own_ns, cycles, total_ns);
  const auto work = cycle.loop().work.percentiles();
  fmt::print("\ncycle p50 {:.1f} us, p99 {:.1f} us, max {:.1f} us\n", us(work.p50), us(work.p99),
             us(work.max));
}

/// One run, printed. @return the exit status.
/// @param paced  a cycle begins when its period does: the caches are the simulation's by then
int run(const std::string& file, bool logged, bool paced) {
  const auto e = runtime::read_experiment(file);
  if (!e) return fail_with(e.error().front());
  const std::string path = std::filesystem::temp_directory_path() / "tandem_cycle_bench.mcap";
  std::unique_ptr<log::Recorder> recorder;
  if (logged) {
    auto opened = log::Recorder::open(path, {}, {});
    if (!opened) return fail_with(opened.error());
    recorder = std::move(*opened);
  }
  SimStages stages;
  const auto opened =
      open_run(file, {.trace_cycles = e->cycles() + e->cycles() / 2}, {.recorder = recorder.get()});
  if (!opened) return fail_with(opened.error());
  (*opened)->robot().set_stage_hook({SimStages::hook, &stages});
  runtime::RobotCycle& cycle = (*opened)->cycle();
  const std::int64_t begin_ns = stages.clock.now_ns();
  bool more = true;
  for (std::int64_t i = 1; more && !(paced && i > 15'000); ++i) {
    if (paced) stages.clock.sleep_until(begin_ns + i * e->loop.period_ns);
    stages.last_ns = stages.clock.now_ns();
    more = cycle.step();
  }
  const double wall_s = static_cast<double>(stages.clock.now_ns() - begin_ns) * 1e-9;
  const double sim_s =
      static_cast<double>(cycle.loop().cycles) * static_cast<double>(e->loop.period_ns) * 1e-9;
  print_stages(cycle, stages);
  fmt::print("{} log: {:.3f} s simulated in {:.3f} s, {:.1f} x real time\n",
             logged ? "with" : "without", sim_s, wall_s, sim_s / wall_s);
  if (recorder != nullptr) (void)recorder->close();
  std::error_code ignored;
  std::filesystem::remove(path, ignored);
  return 0;
}

/// What tracing costs: two equal runs, one of them traced, in turns of 20 cycles.
int trace_cost(const std::string& file) {
  constexpr int kTurn = 20;
  const auto plain_run = open_run(file, {});
  const auto traced_run = open_run(file, {.trace_cycles = 10'000});
  if (!plain_run || !traced_run) return fail_with((plain_run ? traced_run : plain_run).error());
  runtime::RobotCycle& plain = (*plain_run)->cycle();
  runtime::RobotCycle& traced = (*traced_run)->cycle();
  rt::WallClock clock;
  const auto turn_us = [&clock](runtime::RobotCycle& cycle) {
    const std::int64_t begin_ns = clock.now_ns();
    for (int i = 0; i < kTurn; ++i) (void)cycle.step();
    return us(clock.now_ns() - begin_ns) / kTurn;
  };
  std::vector<double> plain_us, traced_us, difference_us;
  for (int i = 0; traced.phase() != runtime::RunPhase::kDone; ++i) {
    const bool plain_first = i % 2 == 0;
    const double first = turn_us(plain_first ? plain : traced);
    const double second = turn_us(plain_first ? traced : plain);
    plain_us.push_back(plain_first ? first : second);
    traced_us.push_back(plain_first ? second : first);
    difference_us.push_back(traced_us.back() - plain_us.back());
  }
  const double base = median(plain_us);
  fmt::print(
      "\ntrace      median cycle {:.2f} us without, {:.2f} us with; median difference "
      "{:+.3f} us: {:+.2f} % of the cycle ({} turns of {} cycles)\n",
      base, median(traced_us), median(difference_us), 100.0 * median(difference_us) / base,
      plain_us.size(), kTurn);
  return 0;
}

/// What estimation costs: beside a squat, each part takes every cycle's image right after the
/// cycle, when the caches hold the cycle's things and not its own.
int estimation_cost(const std::string& file) {
  const auto run = open_run(file, {});
  if (!run) return fail_with(run.error());
  const runtime::Experiment& e = (*run)->experiment();
  const hal::Robot robot = hal::robot_of(e.robot);
  const bool floats = robot.floating_base;
  enum Parts { kBase, kObserver, kWrenches };
  const auto make = [&](Parts parts) {
    estimation::EstimationConfig config;
    if (floats) config.base.emplace();
    if (parts >= kObserver) config.observer.emplace();
    if (parts >= kWrenches && !robot.sites.empty())
      config.wrenches.push_back({.site = robot.sites.front().name});
    return estimation::Estimator::make(robot, &(*run)->kernels(), config, e.loop.period_ns);
  };
  auto base = make(floats ? kBase : kObserver);
  auto both = make(kObserver);
  auto all = make(kWrenches);
  for (const auto* one : {&base, &both, &all}) {
    if (*one) continue;
    fmt::print("\nestimation none: {}\n", one->error().to_string());
    return 0;
  }
  runtime::RobotCycle& cycle = (*run)->cycle();
  rt::WallClock clock;
  std::vector<double> base_us, both_us, all_us;
  for (int i = 0; cycle.step() && i < 12'000; ++i) {
    const auto time = [&](estimation::Estimator& one, std::vector<double>& times) {
      const std::int64_t begin_ns = clock.now_ns();
      one.update(cycle.state());
      if (i > 4000) times.push_back(us(clock.now_ns() - begin_ns));
    };
    if (i % 2 == 0) time(**base, base_us);
    time(**both, both_us);
    time(**all, all_us);
    if (i % 2 != 0) time(**base, base_us);
  }
  const double one = median(base_us), two = median(both_us), wrench = median(all_us) - two;
  if (floats) {
    fmt::print("\nestimation median {:.2f} us base, {:.2f} us observer, {:.2f} us both", one,
               two - one, two);
  } else {
    fmt::print("\nestimation median {:.2f} us observer", two);
  }
  fmt::print(", {:.2f} us a wrench\n", wrench);
  return 0;
}

}  // namespace
}  // namespace tandem::bench

int main(int count, char** arguments) {
  const std::string file = count > 1 ? arguments[1] : TANDEM_CONFIG_FOLDER "/coman/squat.toml";
  fmt::print("{}", tandem::bench::machine_text());
  if (count > 2) return tandem::bench::run(file, false, true);
  for (const bool logged : {false, true}) {
    const int status = tandem::bench::run(file, logged, false);
    if (status != 0) return status;
  }
  const int status = tandem::bench::estimation_cost(file);
  return status != 0 ? status : tandem::bench::trace_cost(file);
}
