// The clock that a cyclic loop sleeps by, as an interface so that tests can inject one.
// Layer: rt.  Thread: any.
#pragma once

#include <cstdint>

#include "base/realtime.hpp"

namespace tandem::rt {

/// A monotonic clock in nanoseconds since an arbitrary origin.
class Clock {
 public:
  virtual ~Clock() = default;

  [[nodiscard]] virtual std::int64_t now_ns() noexcept TANDEM_RT = 0;
  /// Blocks until `deadline_ns`, or returns at once when it has passed. Absolute, so that the
  /// time between the decision to sleep and the sleep does not add up.
  virtual void sleep_until(std::int64_t deadline_ns) noexcept = 0;
};

/// CLOCK_MONOTONIC.
class WallClock final : public Clock {
 public:
  [[nodiscard]] std::int64_t now_ns() noexcept TANDEM_RT override;
  /// clock_nanosleep(TIMER_ABSTIME); resumes after signals, returns early once a stop was
  /// requested (stop_signal.hpp).
  void sleep_until(std::int64_t deadline_ns) noexcept override;
};

}  // namespace tandem::rt
