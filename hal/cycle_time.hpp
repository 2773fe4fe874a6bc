// The time that everything in a cycle goes by.
// Layer: hal.  Thread: any.
#pragma once

#include <cstdint>

namespace tandem::hal {

/// Exact nominal time of a cycle. `time_ns == cycle * period_ns`.
struct CycleTime {
  std::uint64_t cycle = 0;
  std::int64_t time_ns = 0;
  std::int64_t period_ns = 1'000'000;
};

}  // namespace tandem::hal
