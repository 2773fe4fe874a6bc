// The last words of the controllers, for any number of readers.
// Layer: runtime.  Thread: one writer, wait-free; any readers.
#pragma once

#include <atomic>
#include <cstdint>
#include <deque>
#include <span>
#include <vector>

#include "base/realtime.hpp"
#include "base/seqlock.hpp"
#include "hal/text_event.hpp"

namespace tandem::runtime {

/// Each reader counts what it has seen, and learns how many were gone before it came.
class TextHistory {
 public:
  static constexpr std::size_t kSlots = 256;

  TextHistory() {
    for (std::size_t i = 0; i < kSlots; ++i) slots_.emplace_back(1);
  }

  /// The writer's. @rt wait-free
  void write(const hal::TextEvent& event) noexcept TANDEM_RT {
    const std::uint64_t number = count_.load(std::memory_order_relaxed);
    slots_[number % kSlots].write(std::span(&event, 1));
    count_.store(number + 1, std::memory_order_release);
  }
  /// So far.
  [[nodiscard]] std::uint64_t count() const noexcept {
    return count_.load(std::memory_order_acquire);
  }
  /// Those after the first `seen`, which becomes count(); appended to `out`.
  /// @return how many of them are gone
  std::uint64_t read(std::uint64_t& seen, std::vector<hal::TextEvent>& out) const {
    const std::uint64_t all = count();
    std::uint64_t gone = 0;
    for (; seen < all; ++seen) {
      hal::TextEvent event;
      const bool read = slots_[seen % kSlots].read(std::span(&event, 1));
      if (read && count() - seen < kSlots) {
        out.push_back(event);
      } else {
        ++gone;
      }
    }
    return gone;
  }

 private:
  std::deque<Seqlock<hal::TextEvent>> slots_;
  std::atomic<std::uint64_t> count_{0};
};

}  // namespace tandem::runtime
