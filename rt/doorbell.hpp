// What wakes a loop that waits: for its time to go on, or for a command from elsewhere.
// Layer: rt.  Thread: ring() and end() any, a signal handler included; wait() the loop's.
#pragma once

#include <atomic>
#include <cstdint>
#include <limits>

#include "base/realtime.hpp"
#include "rt/stop_signal.hpp"

namespace tandem::rt {

/// Who waits looks at the count first, then at what it waits for, then waits with that count: a
/// ring in between is not lost.
///
///   for (;;) {
///     const std::uint32_t seen = bell.count();
///     if (what_it_waits_for() || bell.ended()) break;
///     bell.wait(seen, deadline_ns);
///   }
class Doorbell {
 public:
  static constexpr std::int64_t kNoDeadline = std::numeric_limits<std::int64_t>::max();

  /// There is something to look at. Wakes whoever waits; one system call.
  void ring() noexcept;
  /// The run is asked to end, for good: from now on nobody waits any more. Rings.
  void end() noexcept;
  /// By end(), by a stop signal, or by request_stop().
  [[nodiscard]] bool ended() const noexcept TANDEM_RT {
    return ended_.load(std::memory_order_relaxed) || stop_requested();
  }

  /// How often it rang.
  [[nodiscard]] std::uint32_t count() const noexcept TANDEM_RT {
    return count_.load(std::memory_order_acquire);
  }
  /// The same as one relaxed load, for a loop that only wants to know whether to look.
  [[nodiscard]] std::uint32_t peek() const noexcept TANDEM_RT {
    return count_.load(std::memory_order_relaxed);
  }
  /// Blocks while the count is `seen`: until a ring, `deadline_ns` on CLOCK_MONOTONIC, or a stop
  /// signal, which is noticed within 20 ms.
  void wait(std::uint32_t seen, std::int64_t deadline_ns = kNoDeadline) const noexcept;

 private:
  std::atomic<std::uint32_t> count_{0};
  std::atomic<bool> ended_{false};
  static_assert(std::atomic<std::uint32_t>::is_always_lock_free && sizeof count_ == 4);
};

}  // namespace tandem::rt
