// The loop's mailbox: what any thread asks of a running loop.
// Layer: runtime.  Thread: ask from any, a signal handler included; take() the loop's.
#pragma once

#include <atomic>
#include <cstdint>
#include <optional>

#include "base/realtime.hpp"
#include "hal/stop_category.hpp"
#include "rt/doorbell.hpp"

namespace tandem::runtime {

/// Wait-free both ways. A request waits until the loop takes it; the same one twice is one. A loop
/// that blocks hears of it by its doorbell. Emergency stops are confirmed.
class Requests {
 public:
  /// What was asked for since the last take().
  struct Pending {
    bool end = false;                                             ///< of the run, in order
    bool reset = false;                                           ///< of every latched fault
    hal::StopCategory emergency_stop = hal::StopCategory::kWarn;  ///< the hardest; kWarn: none
    bool by_watchdog = false;      ///< an emergency stop, of the robot's category
    std::int32_t controller = -1;  ///< with it: the loop hung in this one; -1: in none
  };

  /// @param bell  rings with every request, and knows when the run is to end; outlives this
  explicit Requests(rt::Doorbell& bell) : bell_(&bell) {}

  void end_run() noexcept {
    asked_.fetch_or(kEnd, std::memory_order_relaxed);
    bell_->end();
  }
  void reset_faults() noexcept { ask(kReset); }
  /// Whether an emergency stop was asked for that the loop has not taken yet.
  [[nodiscard]] bool stop_waits() const noexcept {
    return (asked_.load(std::memory_order_relaxed) & (kStop0 | kStop1 | kStop2)) != 0;
  }
  /// kCategory0 or kCategory2; every other category stops as category 1.
  /// @return the stop's number, for confirmed()
  std::uint32_t emergency_stop(hal::StopCategory category) noexcept {
    asked_.fetch_or(category == hal::StopCategory::kCategory0   ? kStop0
                    : category == hal::StopCategory::kCategory2 ? kStop2
                                                                : kStop1,
                    std::memory_order_relaxed);
    // After its flag: whoever takes this number has taken the flag too, now or before.
    const std::uint32_t before = asked_.fetch_add(kOneStop, std::memory_order_relaxed);
    bell_->ring();
    return number_of(before + kOneStop);
  }
  /// The loop hangs; it stops the robot as soon as it can, and ends the run.
  /// @param controller  ControllerHost::at_work(). One watchdog asks.
  void watchdog_stop(std::int32_t controller) noexcept {
    hung_in_.store(controller, std::memory_order_relaxed);
    asked_.fetch_or(kWatchdog | kEnd, std::memory_order_release);
    bell_->end();
  }
  /// The number of the cycle that has carried out the stop `number`; empty: none has yet. A loop
  /// that hangs never does. Not more than 2^23 stops later.
  [[nodiscard]] std::optional<std::uint64_t> confirmed(std::uint32_t number) const noexcept {
    const std::uint32_t ahead = (confirmed_.load(std::memory_order_acquire) - number) & kNumbers;
    if (ahead > kNumbers / 2) return std::nullopt;
    return confirmed_cycle_.load(std::memory_order_relaxed);
  }

  /// Whether take() has something to tell.
  [[nodiscard]] bool pending() const noexcept {
    return (asked_.load(std::memory_order_relaxed) & kFlags) != 0;
  }
  /// The loop's.
  [[nodiscard]] Pending take() noexcept TANDEM_RT {
    const std::uint32_t seen = asked_.load(std::memory_order_relaxed);
    taken_ = number_of(seen);
    if ((seen & kFlags) == 0) return {};
    const std::uint32_t asked = asked_.fetch_and(~kFlags, std::memory_order_acquire);
    taken_ = number_of(asked);
    return {.end = (asked & kEnd) != 0,
            .reset = (asked & kReset) != 0,
            .emergency_stop = (asked & kStop0) != 0   ? hal::StopCategory::kCategory0
                              : (asked & kStop1) != 0 ? hal::StopCategory::kCategory1
                              : (asked & kStop2) != 0 ? hal::StopCategory::kCategory2
                                                      : hal::StopCategory::kWarn,
            .by_watchdog = (asked & kWatchdog) != 0,
            .controller = hung_in_.load(std::memory_order_relaxed)};
  }
  /// The loop's, when the commands of `cycle` are out: what take() told of is carried out.
  void confirm(std::uint64_t cycle) noexcept TANDEM_RT {
    if (taken_ == confirmed_.load(std::memory_order_relaxed)) return;
    confirmed_cycle_.store(cycle, std::memory_order_relaxed);
    confirmed_.store(taken_, std::memory_order_release);
  }

 private:
  // One word: flags below, the count of emergency stops above them.
  static constexpr std::uint32_t kEnd = 1, kReset = 2, kStop0 = 4, kStop1 = 8, kWatchdog = 16,
                                 kStop2 = 32;
  static constexpr std::uint32_t kFlags = 0xFF, kOneStop = 0x100, kNumbers = 0xFF'FFFF;
  static constexpr std::uint32_t number_of(std::uint32_t word) noexcept { return word / kOneStop; }
  void ask(std::uint32_t what) noexcept {
    asked_.fetch_or(what, std::memory_order_relaxed);
    bell_->ring();
  }

  rt::Doorbell* bell_;
  std::atomic<std::uint32_t> asked_{0};
  std::uint32_t taken_ = 0;  // the loop's
  std::atomic<std::int32_t> hung_in_{-1};
  std::atomic<std::uint32_t> confirmed_{0};
  std::atomic<std::uint64_t> confirmed_cycle_{0};
  static_assert(std::atomic<std::uint32_t>::is_always_lock_free);
};

}  // namespace tandem::runtime
