// The loop's mailbox: what any thread asks of a running loop.
// Layer: runtime.  Thread: ask from any, a signal handler included; take() the loop's.
#pragma once

#include <atomic>
#include <cstdint>

#include "base/realtime.hpp"
#include "hal/stop_category.hpp"
#include "rt/doorbell.hpp"

namespace tandem::runtime {

/// Wait-free both ways. A request waits until the loop takes it; the same one twice is one. A loop
/// that blocks hears of it by its doorbell.
class Requests {
 public:
  /// What was asked for since the last take().
  struct Asked {
    bool end = false;                                             ///< of the run, in order
    bool reset = false;                                           ///< of every latched fault
    hal::StopCategory emergency_stop = hal::StopCategory::kWarn;  ///< the hardest; kWarn: none
  };

  /// @param bell  rings with every request, and knows when the run is to end; outlives this
  explicit Requests(rt::Doorbell& bell) : bell_(&bell) {}

  void end_run() noexcept {
    asked_.fetch_or(kEnd, std::memory_order_relaxed);
    bell_->end();
  }
  void reset_faults() noexcept { ask(kReset); }
  /// kCategory0; every other category stops as category 1.
  void emergency_stop(hal::StopCategory category) noexcept {
    ask(category == hal::StopCategory::kCategory0 ? kStop0 : kStop1);
  }

  /// Whether take() has something to tell.
  [[nodiscard]] bool pending() const noexcept {
    return asked_.load(std::memory_order_relaxed) != 0;
  }
  [[nodiscard]] Asked take() noexcept TANDEM_RT {
    if (asked_.load(std::memory_order_relaxed) == 0) return {};
    const std::uint32_t asked = asked_.exchange(0, std::memory_order_relaxed);
    return {.end = (asked & kEnd) != 0,
            .reset = (asked & kReset) != 0,
            .emergency_stop = (asked & kStop0) != 0   ? hal::StopCategory::kCategory0
                              : (asked & kStop1) != 0 ? hal::StopCategory::kCategory1
                                                      : hal::StopCategory::kWarn};
  }

 private:
  static constexpr std::uint32_t kEnd = 1, kReset = 2, kStop0 = 4, kStop1 = 8;
  void ask(std::uint32_t what) noexcept {
    asked_.fetch_or(what, std::memory_order_relaxed);
    bell_->ring();
  }

  rt::Doorbell* bell_;
  std::atomic<std::uint32_t> asked_{0};
  static_assert(std::atomic<std::uint32_t>::is_always_lock_free);
};

}  // namespace tandem::runtime
