// How late does our loop wake up, and how late does cyclictest, in the same run?
// Layer: apps/machine.  Thread: main; the loop has one of its own.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "apps/machine/cyclictest.hpp"
#include "base/result.hpp"
#include "rt/histogram.hpp"
#include "rt/thread_setup.hpp"

namespace tandem::apps {

/// Who runs where, so that neither has the better CPU.
enum class LatencyMode : std::uint8_t {
  kSwap,      ///< at the same time on two CPUs, which they exchange every slice
  kTogether,  ///< at the same time, each on its own CPU throughout
  kTurns,     ///< one after the other on the same CPU, slice by slice
};
[[nodiscard]] const char* to_string(LatencyMode mode);

struct LatencyPlan {
  std::int64_t period_us = 1000;
  double duration_s = 30.0;  ///< that each of the two is measured, per load
  LatencyMode mode = LatencyMode::kSwap;
  int slices = 10;
  std::vector<int> cpus;  ///< two, or one for kTurns
  rt::SchedulingPolicy policy = rt::SchedulingPolicy::kFifo;
  int priority = 80;
  bool cyclictest = true;  ///< false: our loop alone
  std::string folder;      ///< for what the other programs write
};

/// One load's figures.
struct LatencySample {
  std::string load;  ///< "idle", "stress"
  rt::Histogram tandem;
  std::optional<CyclictestResult> cyclictest;
  std::uint64_t skipped = 0;                      ///< our grid points that were missed whole
  std::vector<int> tandem_cpus, cyclictest_cpus;  ///< slice by slice
};

/// Called now and then with the seconds since the measurement began.
using LatencyProgress = std::function<void(double done_s)>;

/// Measures. Our side is rt::CyclicLoop on rt::WallClock, the code that every run uses, with
/// nothing to do in its cycle. Ends early when a stop is requested (rt/stop_signal.hpp).
/// Errors: cyclictest cannot be started, fails, or writes no histogram.
[[nodiscard]] Result<LatencySample> measure_latency(const LatencyPlan& plan,
                                                    const LatencyProgress& progress);

/// CPUs that this process may use.
[[nodiscard]] std::vector<int> usable_cpus();

}  // namespace tandem::apps
