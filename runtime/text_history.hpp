// The last words of the controllers, and the limits that were met, for any number of readers.
// Layer: runtime.  Thread: one writer, wait-free; any readers.
#pragma once

#include <atomic>
#include <cstdint>
#include <deque>
#include <span>
#include <vector>

#include "base/realtime.hpp"
#include "base/seqlock.hpp"
#include "hal/limit_met.hpp"
#include "hal/text_event.hpp"

namespace tandem::runtime {

/// A joint's first command that a limit changed. Plain data: it crosses rings as bytes.
struct LimitNote {
  std::uint64_t cycle = 0;
  std::int64_t time_ns = 0;
  hal::LimitMet met{};
  std::int32_t joint = -1;
  std::int32_t controller = -1;  ///< for ControllerHost::name(); -1: no controller's
};

/// Each reader counts what it has seen, and learns how many were gone before it came.
template <class T>
class NewestHistory {
 public:
  static constexpr std::size_t kSlots = 256;

  NewestHistory() {
    for (std::size_t i = 0; i < kSlots; ++i) slots_.emplace_back(1);
  }

  /// The writer's. @rt wait-free
  void write(const T& event) noexcept TANDEM_RT {
    const std::uint64_t number = count_.load(std::memory_order_relaxed);
    slots_[number % kSlots].write(std::span(&event, 1));
    count_.store(number + 1, std::memory_order_release);
  }
  /// The writer's: nobody reads any more what was written so far of times after `time_ns`.
  void forget_after(std::int64_t time_ns) noexcept {
    forgotten_ns_.store(time_ns, std::memory_order_relaxed);
    forgotten_.store(count_.load(std::memory_order_relaxed), std::memory_order_release);
  }
  /// So far.
  [[nodiscard]] std::uint64_t count() const noexcept {
    return count_.load(std::memory_order_acquire);
  }
  /// Those after the first `seen`, which becomes count(); appended to `out`.
  /// @return how many of them are gone
  std::uint64_t read(std::uint64_t& seen, std::vector<T>& out) const {
    const std::uint64_t all = count();
    const std::uint64_t forgotten = forgotten_.load(std::memory_order_acquire);
    const std::int64_t forgotten_ns = forgotten_ns_.load(std::memory_order_relaxed);
    std::uint64_t gone = 0;
    for (; seen < all; ++seen) {
      T event;
      const bool read = slots_[seen % kSlots].read(std::span(&event, 1));
      if (read && count() - seen < kSlots) {
        if (seen >= forgotten || event.time_ns <= forgotten_ns) out.push_back(event);
      } else {
        ++gone;
      }
    }
    return gone;
  }

 private:
  std::deque<Seqlock<T>> slots_;
  std::atomic<std::uint64_t> count_{0};
  std::atomic<std::uint64_t> forgotten_{0};  // so many of the first, where they are later than
  std::atomic<std::int64_t> forgotten_ns_{0};
};
using TextHistory = NewestHistory<hal::TextEvent>;
using LimitHistory = NewestHistory<LimitNote>;

}  // namespace tandem::runtime
