#include "apps/machine/latency_measure.hpp"

#include <fmt/core.h>
#include <sched.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <thread>

#include "apps/machine/child_process.hpp"
#include "base/open_file.hpp"
#include "base/utf8.hpp"
#include "rt/cyclic_loop.hpp"
#include "rt/stop_signal.hpp"

namespace tandem::apps {
namespace {

using std::chrono::milliseconds;

/// By which cyclictest begins earlier and ends later than our loop, where both run at once.
constexpr milliseconds kMargin{100};

std::string written_to(const std::string& file) {
  return read_file(file, {}, kMostTomlBytes).value_or("");
}

/// Our loop for one slice, on a thread of its own.
class MeasuredCycle {
 public:
  MeasuredCycle(const LatencyPlan& plan, int cpu, std::uint64_t cycles)
      : loop_({.period_ns = plan.period_us * 1000, .pacing = rt::Pacing::kWallClock}, clock_),
        thread_([this, &plan, cpu, cycles] {
          (void)rt::set_up_thread({.policy = plan.policy, .priority = plan.priority, .cpu = cpu});
          while (loop_.statistics().cycles <= cycles && !rt::stop_requested()) {
            (void)loop_.wait();
            loop_.finish();
          }
          done_.store(true, std::memory_order_release);
        }) {}
  ~MeasuredCycle() { thread_.join(); }
  MeasuredCycle(const MeasuredCycle&) = delete;
  MeasuredCycle& operator=(const MeasuredCycle&) = delete;

  [[nodiscard]] bool done() const { return done_.load(std::memory_order_acquire); }
  /// @pre done()
  void add_to(LatencySample& sample) const {
    sample.tandem.add(loop_.statistics().wakeup);
    sample.skipped += loop_.statistics().skipped;
  }

 private:
  rt::WallClock clock_;
  rt::CyclicLoop loop_;
  std::atomic<bool> done_{false};
  std::thread thread_;  // last: it uses the others
};

/// The measurement of one load, slice by slice.
class Measurement {
 public:
  Measurement(const LatencyPlan& plan, const LatencyProgress& progress)
      : plan_(plan),
        progress_(progress),
        cycles_(static_cast<std::uint64_t>(
            std::max(1.0, std::round(plan.duration_s * 1e6 / static_cast<double>(plan.period_us) /
                                     plan.slices)))) {}

  Result<LatencySample> run() {
    LatencySample sample;
    if (plan_.cyclictest) sample.cyclictest.emplace();
    for (int i = 0; i < plan_.slices && !rt::stop_requested(); ++i) {
      const bool exchanged = plan_.mode == LatencyMode::kSwap && i % 2 == 1;
      const int first = plan_.cpus.front();
      const int second = plan_.cpus.back();
      if (const Status s = slice(sample, exchanged ? second : first, exchanged ? first : second);
          !s) {
        return std::unexpected(s.error());
      }
    }
    return sample;
  }

 private:
  /// Both programs for one slice. @param ours, theirs  CPUs.
  Status slice(LatencySample& sample, int ours, int theirs) {
    if (plan_.mode == LatencyMode::kTurns) {
      run_loop(sample, ours);
      return plan_.cyclictest ? run_cyclictest(sample, ours) : Status{};
    }
    if (!plan_.cyclictest) {
      run_loop(sample, ours);
      return {};
    }
    // Starting and ending a process disturbs: it measures before our loop begins, and after its
    // end.
    const auto margin = static_cast<std::uint64_t>(kMargin.count() * 1000 / plan_.period_us);
    auto other = start_cyclictest(theirs, cycles_ + 2 * margin);
    if (!other) return std::unexpected(other.error());
    std::this_thread::sleep_for(kMargin);
    run_loop(sample, ours);
    return finish_cyclictest(sample, *other, theirs);
  }

  void run_loop(LatencySample& sample, int cpu) {
    const MeasuredCycle loop(plan_, cpu, cycles_);
    while (!loop.done()) tell();
    loop.add_to(sample);
    sample.tandem_cpus.push_back(cpu);
  }

  Status run_cyclictest(LatencySample& sample, int cpu) {
    auto other = start_cyclictest(cpu, cycles_);
    if (!other) return std::unexpected(other.error());
    return finish_cyclictest(sample, *other, cpu);
  }

  Result<ChildProcess> start_cyclictest(int cpu, std::uint64_t cycles) {
    return ChildProcess::start(cyclictest_command({.period_us = plan_.period_us,
                                                   .cycles = cycles,
                                                   .policy = plan_.policy,
                                                   .priority = plan_.priority,
                                                   .cpu = cpu,
                                                   .json = json_file()}),
                               output_file());
  }

  Status finish_cyclictest(LatencySample& sample, ChildProcess& process, int cpu) {
    while (!process.poll() && !rt::stop_requested()) tell();
    if (!process.poll()) {
      process.end();  // the run is being stopped: this slice does not count
      return {};
    }
    if (*process.poll() != 0) {
      return fail(fmt::format("cyclictest ended with status {}", *process.poll()),
                  std::string(whole_characters(written_to(output_file()), 300)));
    }
    const auto result = read_cyclictest(written_to(json_file()));
    if (!result) return std::unexpected(result.error());
    sample.cyclictest->add(*result);
    sample.cyclictest_cpus.push_back(cpu);
    return {};
  }

  void tell() {
    std::this_thread::sleep_for(milliseconds(50));
    const std::chrono::duration<double> done = std::chrono::steady_clock::now() - began_;
    progress_(done.count());
  }

  [[nodiscard]] std::string json_file() const { return plan_.folder + "/cyclictest.json"; }
  [[nodiscard]] std::string output_file() const { return plan_.folder + "/cyclictest.txt"; }

  const LatencyPlan& plan_;
  const LatencyProgress& progress_;
  std::uint64_t cycles_;  // per slice
  std::chrono::steady_clock::time_point began_ = std::chrono::steady_clock::now();
};

}  // namespace

const char* to_string(LatencyMode mode) {
  switch (mode) {
    case LatencyMode::kSwap: return "swap";
    case LatencyMode::kTogether: return "together";
    case LatencyMode::kTurns: return "turns";
  }
  return "?";
}

Result<LatencySample> measure_latency(const LatencyPlan& plan, const LatencyProgress& progress) {
  return Measurement(plan, progress).run();
}

std::vector<int> usable_cpus() {
  cpu_set_t set;
  CPU_ZERO(&set);
  std::vector<int> cpus;
  if (sched_getaffinity(0, sizeof set, &set) != 0) return {0};
  for (int cpu = 0; cpu < CPU_SETSIZE; ++cpu) {
    if (CPU_ISSET(static_cast<std::size_t>(cpu), &set)) cpus.push_back(cpu);
  }
  return cpus;
}

}  // namespace tandem::apps
