// The clock that a cyclic loop sleeps by, as an interface so that tests can inject one.
// Layer: rt.  Thread: any.
#pragma once

#include <cstdint>

#include "base/realtime.hpp"

namespace tandem::rt {

class Doorbell;

inline constexpr std::int64_t kSecond_ns = 1'000'000'000;

/// A monotonic clock in nanoseconds since an arbitrary origin.
class Clock {
 public:
  virtual ~Clock() = default;

  [[nodiscard]] virtual std::int64_t now_ns() noexcept TANDEM_RT = 0;
  /// Blocks until `deadline_ns`, or returns at once when it has passed. Absolute, so that the
  /// time between the decision to sleep and the sleep does not add up.
  virtual void sleep_until(std::int64_t deadline_ns) noexcept = 0;
  /// The same, and returns early once the bell has rung more often than `seen`. A clock that is
  /// not the system's hears no bell.
  virtual void sleep_until_rung(std::int64_t deadline_ns, const Doorbell& bell,
                                std::uint32_t seen) noexcept;
};

/// CLOCK_MONOTONIC.
class WallClock final : public Clock {
 public:
  [[nodiscard]] std::int64_t now_ns() noexcept TANDEM_RT override;
  /// clock_nanosleep(TIMER_ABSTIME); resumes after signals, returns early once a stop was
  /// requested (stop_signal.hpp).
  void sleep_until(std::int64_t deadline_ns) noexcept override;
  void sleep_until_rung(std::int64_t deadline_ns, const Doorbell& bell,
                        std::uint32_t seen) noexcept override;
};

}  // namespace tandem::rt
