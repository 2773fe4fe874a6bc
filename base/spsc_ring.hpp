// A wait-free hand-over from the real-time thread to one other thread.
// Layer: base.  Thread: one producer, one consumer.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <vector>

#include "base/realtime.hpp"

namespace tandem {

/// Ring of equal slots of `slot_bytes` raw bytes each. When it is full a push is refused and
/// counted, never waited for. When it is empty it begins at its first slot again: a consumer that
/// keeps up lets both threads use the same few slots, which stay in the caches.
class SpscRing {
 public:
  /// @param slots  rounded up to a power of two, at least 2. All memory is allocated and touched.
  SpscRing(std::size_t slot_bytes, std::size_t slots) : slot_bytes_(slot_bytes) {
    std::size_t capacity = 2;
    while (capacity < slots) capacity *= 2;
    mask_ = capacity - 1;
    bytes_.assign(capacity * slot_bytes_, std::byte{0});
  }

  [[nodiscard]] std::size_t slot_bytes() const noexcept { return slot_bytes_; }
  [[nodiscard]] std::size_t capacity() const noexcept { return mask_ + 1; }
  /// Slots in use; exact for the calling side, a bound for the other.
  [[nodiscard]] std::size_t size() const noexcept {
    return head_.load(std::memory_order_acquire) - tail_.load(std::memory_order_acquire);
  }
  /// Slots that were filled so far.
  [[nodiscard]] std::uint64_t pushed() const noexcept {
    return head_.load(std::memory_order_acquire);
  }
  /// Pushes refused so far.
  [[nodiscard]] std::uint64_t dropped() const noexcept {
    return dropped_.load(std::memory_order_relaxed);
  }

  /// Producer: the next free slot to fill in place, or empty (and counted) when full.
  [[nodiscard]] std::span<std::byte> begin_push() noexcept TANDEM_RT {
    const std::size_t head = head_.load(std::memory_order_relaxed);
    const std::size_t used = head - tail_.load(std::memory_order_acquire);
    if (used > mask_) {
      dropped_.fetch_add(1, std::memory_order_relaxed);
      return {};
    }
    if (used == 0) first_ = head;  // the consumer reads it when there is a slot
    return {bytes_.data() + place(head), slot_bytes_};
  }
  /// Producer: whether begin_push() gives so many slots; if not, one refused push is counted.
  [[nodiscard]] bool has_room(std::size_t slots) noexcept TANDEM_RT {
    if (size() + slots <= capacity()) return true;
    dropped_.fetch_add(1, std::memory_order_relaxed);
    return false;
  }
  /// Producer: publishes the slot that begin_push() gave.
  void end_push() noexcept TANDEM_RT {
    head_.store(head_.load(std::memory_order_relaxed) + 1, std::memory_order_release);
  }

  /// Consumer: the oldest slot, or empty when there is none. Valid until pop().
  [[nodiscard]] std::span<const std::byte> front() const noexcept {
    const std::size_t tail = tail_.load(std::memory_order_relaxed);
    if (tail == head_.load(std::memory_order_acquire)) return {};
    return {bytes_.data() + place(tail), slot_bytes_};
  }
  /// Consumer: gives the oldest slot back.
  void pop() noexcept {
    tail_.store(tail_.load(std::memory_order_relaxed) + 1, std::memory_order_release);
  }

 private:
  [[nodiscard]] std::size_t place(std::size_t count) const noexcept {
    return ((count - first_) & mask_) * slot_bytes_;
  }

  std::size_t slot_bytes_;
  std::size_t mask_ = 0;
  std::vector<std::byte> bytes_;
  std::size_t first_ = 0;  // the count whose slot is at the beginning; the producer's while empty
  alignas(64) std::atomic<std::size_t> head_{0};
  alignas(64) std::atomic<std::size_t> tail_{0};
  alignas(64) std::atomic<std::uint64_t> dropped_{0};
};

}  // namespace tandem
