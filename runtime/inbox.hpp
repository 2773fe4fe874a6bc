// Where everything arrives that is asked of a running loop from outside.
// Layer: runtime.  Thread: the asking side says which; the loop's side is RT.
#pragma once

#include <atomic>
#include <cstdint>
#include <cstring>
#include <optional>
#include <type_traits>

#include "base/realtime.hpp"
#include "base/spsc_ring.hpp"
#include "hal/stop_category.hpp"
#include "rt/clock_control.hpp"
#include "rt/doorbell.hpp"
#include "runtime/cycle_request.hpp"

namespace tandem::runtime {

/// One bell wakes a loop that blocks, for any of them:
///
///   urgent    the end, a reset, an emergency stop: one atomic word, wait-free, from any thread and
///             from signal handlers. The same one twice is one. Stops are confirmed.
///   requests  of RunServices, in their order, each with an answer: two rings
///   time      pause, resume, step, rate of simulated time: clock()
///
/// Two things are no requests and go past it: the commands of an owner in another process, of which
/// only the newest counts (hal::RemoteCommandPort), and faults, which are injected into the
/// emulated robot and not into the loop (sim::SimRobot::post).
class Inbox {
 public:
  static constexpr std::size_t kCapacity = 16;  ///< requests that wait
  static constexpr std::uint64_t kNow = ~std::uint64_t{0};

  /// Pacing, rate and start_paused of the loop.
  explicit Inbox(const rt::CyclicLoopConfig& loop) : clock_(loop, bell_) {}

  // Urgent: any thread, signal handlers included.

  void end_run() noexcept {
    urgent_.fetch_or(kEnd, std::memory_order_relaxed);
    bell_.end();
  }
  /// @param known  Progress::stopped_before when it was asked for: a later stop wins. kNow: the
  ///               asker knows all but those of the cycle that takes it
  void reset_faults(std::uint64_t known = kNow) noexcept {
    reset_known_.store(known, std::memory_order_relaxed);
    urgent_.fetch_or(kReset, std::memory_order_release);
    bell_.ring();
  }
  /// kCategory0 or kCategory2; every other category stops as category 1.
  /// @return the stop's number, for confirmed()
  std::uint32_t emergency_stop(hal::StopCategory category) noexcept {
    urgent_.fetch_or(category == hal::StopCategory::kCategory0   ? kStop0
                     : category == hal::StopCategory::kCategory2 ? kStop2
                                                                 : kStop1,
                     std::memory_order_relaxed);
    // After its flag: whoever takes this number has taken the flag too, now or before.
    const std::uint32_t before = urgent_.fetch_add(kOneStop, std::memory_order_relaxed);
    bell_.ring();
    return number_of(before + kOneStop);
  }
  /// The loop hangs; it stops the robot as soon as it can, and ends the run.
  /// @param controller  ControllerHost::at_work(). One watchdog asks.
  void watchdog_stop(std::int32_t controller) noexcept {
    hung_in_.store(controller, std::memory_order_relaxed);
    urgent_.fetch_or(kWatchdog | kEnd, std::memory_order_release);
    bell_.end();
  }
  /// Whether an emergency stop was asked for that the loop has not taken yet.
  [[nodiscard]] bool stop_waits() const noexcept {
    return (urgent_.load(std::memory_order_relaxed) & (kStop0 | kStop1 | kStop2)) != 0;
  }
  /// Whether the last cycle is over. What confirmed() then lacks no cycle carries out: ask this
  /// first.
  [[nodiscard]] bool closed() const noexcept { return closed_.load(std::memory_order_acquire); }
  /// The number of the cycle that has carried out the stop `number`; empty: none has yet. A loop
  /// that hangs never does. Not more than 2^23 stops later.
  [[nodiscard]] std::optional<std::uint64_t> confirmed(std::uint32_t number) const noexcept {
    const std::uint32_t ahead = (confirmed_.load(std::memory_order_acquire) - number) & kNumbers;
    if (ahead > kNumbers / 2) return std::nullopt;
    return confirmed_cycle_.load(std::memory_order_relaxed);
  }

  // Requests: one thread at a time (RunServices' mutex).

  /// False when the loop has not taken the last kCapacity requests.
  [[nodiscard]] bool ask(const CycleRequest& request) noexcept { return put(requests_, request); }
  /// The next answer, if there is one.
  [[nodiscard]] std::optional<CycleAnswer> take_answer() noexcept {
    return get<CycleAnswer>(answers_);
  }

  /// Any thread, not in a signal handler; the loop waits by it.
  [[nodiscard]] rt::ClockControl& clock() noexcept { return clock_; }
  [[nodiscard]] const rt::ClockControl& clock() const noexcept { return clock_; }

  /// Nobody waits for the answer to request `number` any more.
  void leave(std::uint64_t number) noexcept {
    left_.fetch_or(std::uint64_t{1} << (number % 64), std::memory_order_acq_rel);
  }

  // The loop's.

  /// What was asked for since the last take_urgent().
  struct Urgent {
    bool end = false;                                             ///< of the run, in order
    bool reset = false;                                           ///< of every latched fault
    std::uint64_t known = kNow;                                   ///< with it: reset_faults()'s
    hal::StopCategory emergency_stop = hal::StopCategory::kWarn;  ///< the hardest; kWarn: none
    bool by_watchdog = false;      ///< an emergency stop, of the robot's category
    std::int32_t controller = -1;  ///< with it: the loop hung in this one; -1: in none
    [[nodiscard]] bool any() const noexcept {
      return end || reset || by_watchdog || emergency_stop != hal::StopCategory::kWarn;
    }
  };
  /// Whether take_urgent() has something.
  [[nodiscard]] bool is_urgent() const noexcept {
    return (urgent_.load(std::memory_order_relaxed) & kFlags) != 0;
  }
  [[nodiscard]] Urgent take_urgent() noexcept TANDEM_RT {
    const std::uint32_t seen = urgent_.load(std::memory_order_relaxed);
    taken_ = number_of(seen);
    if ((seen & kFlags) == 0) return {};
    const std::uint32_t asked = urgent_.fetch_and(~kFlags, std::memory_order_acquire);
    taken_ = number_of(asked);
    return {.end = (asked & kEnd) != 0,
            .reset = (asked & kReset) != 0,
            .known = reset_known_.load(std::memory_order_relaxed),
            .emergency_stop = (asked & kStop0) != 0   ? hal::StopCategory::kCategory0
                              : (asked & kStop1) != 0 ? hal::StopCategory::kCategory1
                              : (asked & kStop2) != 0 ? hal::StopCategory::kCategory2
                                                      : hal::StopCategory::kWarn,
            .by_watchdog = (asked & kWatchdog) != 0,
            .controller = hung_in_.load(std::memory_order_relaxed)};
  }
  /// When the commands of `cycle` are out: what take_urgent() gave is carried out.
  void confirm(std::uint64_t cycle) noexcept TANDEM_RT {
    if (taken_ == confirmed_.load(std::memory_order_relaxed)) return;
    confirmed_cycle_.store(cycle, std::memory_order_relaxed);
    confirmed_.store(taken_, std::memory_order_release);
  }
  /// After the last confirm().
  void close() noexcept TANDEM_RT { closed_.store(true, std::memory_order_release); }
  [[nodiscard]] std::optional<CycleRequest> take_request() noexcept TANDEM_RT {
    return get<CycleRequest>(requests_);
  }
  /// Whether nobody waits for this answer any more: leave(). Once.
  [[nodiscard]] bool take_left(std::uint64_t number) noexcept TANDEM_RT {
    const std::uint64_t bit = std::uint64_t{1} << (number % 64);
    return (left_.fetch_and(~bit, std::memory_order_acq_rel) & bit) != 0;
  }
  void answer(const CycleAnswer& answer) noexcept TANDEM_RT { (void)put(answers_, answer); }
  [[nodiscard]] rt::Doorbell& bell() noexcept { return bell_; }
  [[nodiscard]] const rt::Doorbell& bell() const noexcept { return bell_; }

 private:
  // One word: flags below, the count of emergency stops above them.
  static constexpr std::uint32_t kEnd = 1, kReset = 2, kStop0 = 4, kStop1 = 8, kWatchdog = 16,
                                 kStop2 = 32;
  static constexpr std::uint32_t kFlags = 0xFF, kOneStop = 0x100, kNumbers = 0xFF'FFFF;
  static constexpr std::uint32_t number_of(std::uint32_t word) noexcept { return word / kOneStop; }

  template <class T>
  static bool put(SpscRing& ring, const T& value) noexcept TANDEM_RT {
    static_assert(std::is_trivially_copyable_v<T>);
    const std::span<std::byte> slot = ring.begin_push();
    if (slot.empty()) return false;
    std::memcpy(slot.data(), &value, sizeof value);
    ring.end_push();
    return true;
  }
  template <class T>
  static std::optional<T> get(SpscRing& ring) noexcept TANDEM_RT {
    const std::span<const std::byte> slot = ring.front();
    if (slot.empty()) return std::nullopt;
    T value;
    std::memcpy(&value, slot.data(), sizeof value);
    ring.pop();
    return value;
  }

  rt::Doorbell bell_;
  rt::ClockControl clock_;

  std::atomic<std::uint32_t> urgent_{0};
  std::atomic<std::uint64_t> left_{0};  // bits of leave()
  std::uint32_t taken_ = 0;             // the loop's
  std::atomic<std::int32_t> hung_in_{-1};
  std::atomic<std::uint64_t> reset_known_{kNow};
  std::atomic<std::uint32_t> confirmed_{0};
  std::atomic<std::uint64_t> confirmed_cycle_{0};
  std::atomic<bool> closed_{false};
  static_assert(std::atomic<std::uint32_t>::is_always_lock_free);

  SpscRing requests_{sizeof(CycleRequest), kCapacity};
  // Every request that waits has room for its answer, and so have those that nobody awaits.
  SpscRing answers_{sizeof(CycleAnswer), 8 * kCapacity};
};

}  // namespace tandem::runtime
