// Where the time of a cycle goes: a squat as `tandem run` runs it, stage by stage, the stages of
// the simulation inside `read` as well.
//   cycle_bench [EXPERIMENT] [KERNELS.so]      (default: COMAN's squat)
// Times mean something on an idle machine only; the head says which one it was.
#include <fmt/core.h>
#include <sched.h>
#include <sys/utsname.h>

#include <array>
#include <filesystem>
#include <fstream>

#include "controllers/plugin_loader.hpp"
#include "model/kernel_library.hpp"
#include "rt/clock.hpp"
#include "runtime/experiment.hpp"
#include "runtime/robot_cycle.hpp"

namespace tandem::bench {
namespace {

/// Takes the time between the calls of SimRobot's hook.
struct SimStages {
  rt::WallClock clock;
  std::array<std::int64_t, sim::kStages> sum_ns{};
  std::int64_t last_ns = 0;

  static void hook(void* self, sim::Stage finished) {
    auto* stages = static_cast<SimStages*>(self);
    const std::int64_t now_ns = stages->clock.now_ns();
    stages->sum_ns[static_cast<std::size_t>(finished)] += now_ns - stages->last_ns;
    stages->last_ns = now_ns;
  }
};

constexpr const char* kSimStages[sim::kStages] = {
    "master: SYNC", "plant", "sensors", "boards' firmware", "master: decode", "truth"};

std::string first_value(const char* file, const std::string& key) {
  std::ifstream in(file);
  for (std::string line; std::getline(in, line);) {
    if (line.starts_with(key)) return line.substr(line.find(':') + 2);
  }
  return "?";
}

void print_machine() {
  utsname system{};
  uname(&system);
  fmt::print("machine    {}\nkernel     {} {}\nscheduler  {}\n",
             first_value("/proc/cpuinfo", "model name"), system.sysname, system.release,
             sched_getscheduler(0) == SCHED_OTHER ? "SCHED_OTHER" : "real-time");
}

void row(const std::string& name, std::int64_t sum_ns, std::uint64_t cycles,
         std::int64_t total_ns) {
  fmt::print("{:24} {:9.2f} {:8.1f} %\n", name,
             static_cast<double>(sum_ns) * 1e-3 / static_cast<double>(cycles),
             100.0 * static_cast<double>(sum_ns) / static_cast<double>(total_ns));
}

void print_stages(const runtime::RobotCycle& cycle, const SimStages& sim) {
  const std::uint64_t cycles = cycle.loop().cycles;
  std::int64_t total_ns = 0;
  for (const std::int64_t stage : cycle.stage_ns()) total_ns += stage;
  fmt::print("\n{:24} {:>9} {:>8}\n", "stage", "us/cycle", "share");
  for (std::size_t i = 0; i < runtime::kStages; ++i) {
    row(runtime::to_string(static_cast<runtime::Stage>(i)), cycle.stage_ns()[i], cycles, total_ns);
    if (i != static_cast<std::size_t>(runtime::Stage::kRead)) continue;
    for (std::size_t s = 0; s < sim::kStages; ++s) {
      row(fmt::format("  {}", kSimStages[s]), sim.sum_ns[s], cycles, total_ns);
    }
  }
  row("all", total_ns, cycles, total_ns);
  const auto execution = cycle.loop().execution.percentiles();
  fmt::print("\ncycle p50 {:.1f} us, p99 {:.1f} us, max {:.1f} us\n",
             static_cast<double>(execution.p50) * 1e-3, static_cast<double>(execution.p99) * 1e-3,
             static_cast<double>(execution.max) * 1e-3);
}

int fail_with(const Error& error) {
  fmt::print(stderr, "{}\n", error.to_string());
  return 2;
}

/// One run, printed. @return the exit status.
int run(const std::string& file, const std::string& library, bool logged) {
  auto e = runtime::read_experiment(file);
  if (!e) return fail_with(e.error().front());
  const auto kernels = model::load_kernels(library);
  if (!kernels) return fail_with(kernels.error());
  runtime::ControllerHost host(e->robot, kernels->get(), e->loop.period_ns);
  for (const runtime::ControllerSpec& spec : e->controllers) {
    auto plugin = load_controller(spec.plugin, {TANDEM_CONTROLLER_FOLDER});
    if (!plugin) return fail_with(plugin.error());
    const Status added = host.add(spec.name, std::move(*plugin), spec.parameters);
    if (!added) return fail_with(added.error());
  }
  auto robot = sim::SimRobot::create(e->robot, kernels->get(), e->sim_robot_config());
  if (!robot) return fail_with(robot.error());

  const std::string path = std::filesystem::temp_directory_path() / "tandem_cycle_bench.mcap";
  std::unique_ptr<log::Recorder> recorder;
  if (logged) {
    auto opened = log::Recorder::open(path, {}, {});
    if (!opened) return fail_with(opened.error());
    recorder = std::move(*opened);
  }
  SimStages stages;
  (*robot)->set_stage_hook({SimStages::hook, &stages});
  rt::WallClock clock;
  runtime::RobotCycle cycle({e->robot, **robot, host, clock, recorder.get(), &(*robot)->truth()},
                            {.loop = e->loop,
                             .running_cycles = e->cycles(),
                             .settle_cycles = e->settle_cycles(),
                             .time_stages = true});
  const std::int64_t begin_ns = clock.now_ns();
  bool more = true;
  while (more) {
    stages.last_ns = clock.now_ns();
    more = cycle.step();
  }
  const double wall_s = static_cast<double>(clock.now_ns() - begin_ns) * 1e-9;
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

}  // namespace
}  // namespace tandem::bench

int main(int count, char** arguments) {
  const std::string file = count > 1 ? arguments[1] : TANDEM_CONFIG_FOLDER "/coman/squat.toml";
  const std::string library = count > 2 ? arguments[2] : TANDEM_MODEL_FOLDER "/coman_kernels.so";
  tandem::bench::print_machine();
  const int first = tandem::bench::run(file, library, false);
  return first != 0 ? first : tandem::bench::run(file, library, true);
}
