// Whether the loop still cycles, and whether it is at work or waits: for a watchdog.
// Layer: runtime.  Thread: enter(), leave() and stand_still() the loop's, the others any.
#pragma once

#include <atomic>
#include <cstdint>

#include "base/realtime.hpp"

namespace tandem::runtime {

/// A count that moves whenever the loop begins or ends the part of a cycle that may not block.
class Heartbeat {
 public:
  // The loop's. @rt one plain store.
  void enter() noexcept TANDEM_RT { beats_.store(++count_, std::memory_order_relaxed); }
  void leave() noexcept TANDEM_RT { beats_.store(++count_, std::memory_order_relaxed); }

  /// The loop's last: it crashed, and does not go on. Safe in a signal handler.
  void stand_still() noexcept { stands_still_.store(true, std::memory_order_relaxed); }

  [[nodiscard]] bool stands_still() const noexcept {
    return stands_still_.load(std::memory_order_relaxed);
  }
  /// 0: the first cycle has not begun.
  [[nodiscard]] std::uint64_t beats() const noexcept {
    return beats_.load(std::memory_order_relaxed);
  }
  /// Between enter() and leave(). Else the loop waits: for its time, for the robot, for an owner.
  [[nodiscard]] static bool at_work(std::uint64_t beats) noexcept { return beats % 2 == 1; }

 private:
  std::uint64_t count_ = 0;
  std::atomic<std::uint64_t> beats_{0};
  std::atomic<bool> stands_still_{false};
};

}  // namespace tandem::runtime
