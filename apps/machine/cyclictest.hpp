// cyclictest of Debian's rt-tests: its command line, and the histogram that it writes.
// Layer: apps/machine.  Thread: main.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "rt/histogram.hpp"
#include "rt/thread_setup.hpp"

namespace tandem::apps {

struct CyclictestPlan {
  std::int64_t period_us = 1000;
  std::uint64_t cycles = 0;
  rt::SchedulingPolicy policy = rt::SchedulingPolicy::kFifo;
  int priority = 80;
  int cpu = 0;
  std::string json;  ///< file that it writes
};

/// One measuring thread, absolute sleeps on CLOCK_MONOTONIC, locked memory: as our loop does it.
[[nodiscard]] std::vector<std::string> cyclictest_command(const CyclictestPlan& plan);

/// Wake-up latencies as cyclictest counts them: whole microseconds, rounded down, the smallest
/// first.
struct CyclictestResult {
  std::vector<rt::HistogramBin> bins;
  std::uint64_t cycles = 0;
  std::int64_t max_ns = 0;

  /// The smallest value that at least `fraction` of the latencies do not exceed; 0 when empty.
  [[nodiscard]] std::int64_t percentile_ns(double fraction) const;
  [[nodiscard]] rt::Percentiles percentiles() const;
  void add(const CyclictestResult& other);
};

/// Reads the text of its --json file. Latencies beyond the histogram's end count at the maximum.
/// Errors: no JSON, or not cyclictest's.
[[nodiscard]] Result<CyclictestResult> read_cyclictest(const std::string& text);

}  // namespace tandem::apps
