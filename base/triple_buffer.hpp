// A triple buffer: the newest value that one thread makes, for one other that takes it. What it
// does not take is lost. Layer: base.  Thread: one writer, one reader, both wait-free.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>

#include "base/realtime.hpp"

namespace tandem {

/// Three values: one is written, one is read, one waits.
template <class T>
class TripleBuffer {
 public:
  explicit TripleBuffer(const T& value) : slots_{value, value, value} {}

  /// The writer's: to be filled, then published.
  [[nodiscard]] T& back() noexcept { return slots_[back_]; }
  void publish() noexcept {
    back_ = static_cast<std::uint8_t>(
        middle_.exchange(static_cast<std::uint8_t>(back_ | kFresh), std::memory_order_acq_rel) &
        kIndex);
  }

  /// The reader's: takes the newest. False: front() is the newest already.
  bool refresh() noexcept TANDEM_RT {
    if ((middle_.load(std::memory_order_acquire) & kFresh) == 0) return false;
    front_ =
        static_cast<std::uint8_t>(middle_.exchange(front_, std::memory_order_acq_rel) & kIndex);
    return true;
  }
  [[nodiscard]] const T& front() const noexcept TANDEM_RT { return slots_[front_]; }

 private:
  static constexpr std::uint8_t kFresh = 4, kIndex = 3;
  std::array<T, 3> slots_;
  std::uint8_t back_ = 0, front_ = 1;
  std::atomic<std::uint8_t> middle_{2};
};

}  // namespace tandem
