// A clock of the system, read in nanoseconds.
// Layer: base.  Thread: any.
#pragma once

#include <cstdint>
#include <ctime>

#include "base/realtime.hpp"

namespace tandem {

/// @param clock  CLOCK_MONOTONIC, which is std::chrono::steady_clock's, or CLOCK_REALTIME
/// @rt one read, no system call
[[nodiscard]] inline std::int64_t clock_ns(clockid_t clock) noexcept TANDEM_RT {
  timespec now{};
  ::clock_gettime(clock, &now);
  return static_cast<std::int64_t>(now.tv_sec) * 1'000'000'000 + now.tv_nsec;
}

}  // namespace tandem
