// What a cycle over SocketCAN costs this computer, without the kernel: controllers, limits, drive
// master, frames, sockets' batches, all of it as `tandem run --hal can` runs it. The system calls
// lead to an emulated robot in this process (fake_can_kernel.hpp), and the time within them is
// left out. Cycles in which the controllers run are counted.
//   can_cycle_bench [EXPERIMENT] [--seconds S] [--repeats N] [--cpu N] [--json FILE]
// Two ways: one cycle after the other, and at the loop's period on the wall clock, where the rest
// of the machine has used the caches in between.
#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>

#include "apps/can/can_sockets.hpp"
#include "bench/fake_can_kernel.hpp"
#include "bench/rig.hpp"
#include "hal/ethercat-can/can_backend.hpp"
#include "rt/histogram.hpp"
#include "rt/thread_setup.hpp"

namespace tandem::bench {
namespace {

using Json = nlohmann::ordered_json;

struct Options {
  std::string experiment = TANDEM_CONFIG_FOLDER "/coman/hold.toml";
  double seconds = 10.0;
  int repeats = 5;
  int cpu = -1;
  std::string json;
};

/// The wall clock, standing still within system calls.
class OwnClock final : public rt::Clock {
 public:
  std::int64_t now_ns() noexcept TANDEM_RT override { return wall_.now_ns() - kernel->inside_ns(); }
  void sleep_until(std::int64_t /*deadline_ns*/) noexcept override {}  // one after the other
  const FakeCanKernel* kernel = nullptr;

 private:
  rt::WallClock wall_;
};

/// One run's figures.
struct Sample {
  std::vector<std::int64_t> work_ns;                           ///< our part of each cycle
  std::array<std::int64_t, runtime::kCycleStages> stage_ns{};  ///< sums, of a traced run
  double calls_per_cycle = 0.0;

  [[nodiscard]] rt::Percentiles percentiles() const {
    rt::Histogram histogram;
    for (const std::int64_t ns : work_ns) histogram.record(ns);
    return histogram.percentiles();
  }
};

enum class Way : std::uint8_t { kFree, kPaced };

/// The run's cycles, one by one, with the time of those in which controllers run.
Result<Sample> take(runtime::RobotCycle& cycle, OwnClock& own, Way way, std::int64_t period_ns) {
  const FakeCanKernel& kernel = *own.kernel;
  rt::WallClock wall;
  Sample sample;
  std::uint64_t calls = 0;
  std::int64_t next_ns = wall.now_ns();
  for (bool more = true; more;) {
    const bool running = cycle.phase() == runtime::RunPhase::kRunning;
    if (way == Way::kPaced && running) {
      next_ns = std::max(next_ns + period_ns, wall.now_ns());
      wall.sleep_until(next_ns);
    }
    const std::uint64_t before = kernel.calls();
    const std::int64_t begin_ns = own.now_ns();
    more = cycle.step();
    const std::int64_t work_ns = own.now_ns() - begin_ns;
    if (!running || cycle.phase() != runtime::RunPhase::kRunning) continue;
    sample.work_ns.push_back(work_ns);
    calls += kernel.calls() - before;
  }
  const auto faults = cycle.faults();
  if (!faults.empty()) return fail("the run ended in a fault: " + faults.front().text);
  for (const runtime::CycleStamps& stamps : cycle.trace().cycles()) {
    for (std::size_t i = 0; i < runtime::kCycleStages; ++i) {
      sample.stage_ns[i] += stamps.stage_ns(static_cast<runtime::CycleStage>(i));
    }
  }
  sample.calls_per_cycle = static_cast<double>(calls) / static_cast<double>(sample.work_ns.size());
  return sample;
}

/// An emulated robot behind sockets that are not the kernel's.
struct Wire {
  std::unique_ptr<sim::EmulatedRobot> robot;
  std::optional<FakeCanKernel> kernel;
  std::unique_ptr<apps::CanSockets> sockets;
  OwnClock clock;

  Diagnostics connect(runtime::Composition& c) {
    const runtime::Experiment& e = c.experiment;
    auto made = sim::EmulatedRobot::create(e.robot, c.kernels.get(), e.sim_robot_config());
    if (!made) return {made.error()};
    robot = std::move(*made);
    std::vector<std::string> names;
    for (const hal::BusConfig& bus : e.robot.buses) names.push_back(bus.interface);
    clock.kernel = &kernel.emplace(*robot, names, e.loop.period_ns);
    auto opened = apps::CanSockets::open(e.robot, hal::can::SocketSide::kMaster, true);
    if (!opened) return opened.error();
    sockets = std::move(*opened);
    auto backend = hal::can::CanBackend::create(e.robot, sockets->buses(), *sockets, {});
    if (!backend) return {backend.error()};
    c.backend = std::move(*backend);
    return {};
  }
};

Result<Sample> measure(const Options& options, Way way, bool traced) {
  const auto e = runtime::read_experiment(options.experiment);
  if (!e) return std::unexpected(e.error().front());
  const auto cycles =
      static_cast<std::size_t>(options.seconds * 1e9) / static_cast<std::size_t>(e->loop.period_ns);
  Wire wire;
  const auto run =
      open_run(options.experiment,
               {.duration_s = options.seconds,
                .hal = "can",
                .on_fault = "end",
                .trace_cycles = traced ? cycles : 0},
               {.clock = &wire.clock}, [&](runtime::Composition& c) { return wire.connect(c); });
  if (!run) return std::unexpected(run.error());
  return take((*run)->cycle(), wire.clock, way, e->loop.period_ns);
}

/// Cycle by cycle the median of all runs: they compute the same, so that what only one of them has
/// is not ours (an interrupt, another machine on this CPU).
Sample median_of(const std::vector<Sample>& runs) {
  Sample out;
  std::size_t cycles = runs.front().work_ns.size();
  for (const Sample& run : runs) cycles = std::min(cycles, run.work_ns.size());
  for (std::size_t k = 0; k < cycles; ++k) {
    std::vector<double> values;
    for (const Sample& run : runs) values.push_back(static_cast<double>(run.work_ns[k]));
    out.work_ns.push_back(static_cast<std::int64_t>(median(std::move(values))));
  }
  return out;
}

void print_row(const std::string& name, const rt::Percentiles& p) {
  fmt::print("{:22} {:8.2f} {:8.2f} {:8.2f} {:9.2f}\n", name, us(p.p50), us(p.p99), us(p.p999),
             us(p.max));
}

void print_stages(const Sample& sample) {
  fmt::print("  stages' means [us], {:.1f} system calls:", sample.calls_per_cycle);
  for (std::size_t i = 1; i < runtime::kCycleStages; ++i) {
    fmt::print(" {} {:.2f}", runtime::to_string(static_cast<runtime::CycleStage>(i)),
               us(sample.stage_ns[i]) / static_cast<double>(sample.work_ns.size()));
  }
  fmt::print("\n");
}

Json percentiles_json(const rt::Percentiles& p) {
  return {{"p50", p.p50}, {"p99", p.p99}, {"p999", p.p999}, {"max", p.max}};
}

/// All runs of one way, printed. The JSON of its figures; null after an error, which is printed.
Json run_way(const Options& options, Way way) {
  fmt::print("{}\n", way == Way::kFree ? "one after the other" : "at the loop's period");
  Json json;
  std::vector<Sample> runs;
  for (int i = 0; i < options.repeats; ++i) {
    auto sample = measure(options, way, false);
    if (!sample) return fail_with(sample.error()), nullptr;
    const rt::Percentiles p = sample->percentiles();
    print_row(fmt::format("  run {}", i + 1), p);
    json["runs"].push_back(percentiles_json(p));
    runs.push_back(std::move(*sample));
  }
  const rt::Percentiles p = median_of(runs).percentiles();
  print_row("  cycles' medians", p);
  json["cycles_medians"] = percentiles_json(p);
  const auto traced = measure(options, way, true);
  if (!traced) return fail_with(traced.error()), nullptr;
  print_stages(*traced);
  return json;
}

int run(const Options& options) {
  const rt::ThreadReport thread = rt::set_up_thread({.cpu = options.cpu});
  fmt::print("{}", machine_text());
  if (!thread.complete()) fmt::print("note: {}", thread.to_string());
  fmt::print("experiment {}, {} s per run, {} runs\n", options.experiment, options.seconds,
             options.repeats);
  fmt::print("\n{:22} {:>8} {:>8} {:>8} {:>9}\n", "ours per cycle [us]", "p50", "p99", "p99.9",
             "max");
  Json json;
  json["free_ns"] = run_way(options, Way::kFree);
  json["paced_ns"] = json["free_ns"].is_null() ? Json() : run_way(options, Way::kPaced);
  if (json["paced_ns"].is_null()) return 2;
  if (!options.json.empty()) std::ofstream(options.json) << json.dump(2) << "\n";
  return 0;
}

}  // namespace
}  // namespace tandem::bench

int main(int count, char** arguments) {
  tandem::bench::Options options;
  CLI::App app{"The cost of a cycle over SocketCAN, without the kernel's"};
  app.add_option("experiment", options.experiment,
                 "Experiment TOML (default: COMAN holding its joints)");
  app.add_option("--seconds", options.seconds, "Of each run")->check(CLI::PositiveNumber);
  app.add_option("--repeats", options.repeats, "Runs of each way")->check(CLI::Range(1, 1000));
  app.add_option("--cpu", options.cpu, "The CPU to run on (default: any)");
  app.add_option("--json", options.json, "File for the figures");
  CLI11_PARSE(app, count, arguments);
  return tandem::bench::run(options);
}
