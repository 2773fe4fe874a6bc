// A block of values that one thread writes and any number of others read whole.
// Layer: base.  Thread: one writer, wait-free; any readers.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <type_traits>
#include <vector>

#include "base/realtime.hpp"

namespace tandem {

/// `size` elements of T. A reader that meets a write tries again; the writer never waits.
template <class T>
class Seqlock {
  static_assert(std::is_trivially_copyable_v<T>);
  static_assert(sizeof(T) % sizeof(std::uint64_t) == 0, "fill the type up to whole words");

 public:
  explicit Seqlock(std::size_t size)
      : size_(size), words_(size * sizeof(T) / sizeof(std::uint64_t)) {}

  [[nodiscard]] std::size_t size() const noexcept { return size_; }

  /// The writer's. @pre values.size() == size()
  /// @rt wait-free: a store per word.
  void write(std::span<const T> values) noexcept TANDEM_RT {
    const std::uint64_t before = count_.load(std::memory_order_relaxed);
    count_.store(before + 1, std::memory_order_relaxed);
    const auto* bytes = reinterpret_cast<const std::byte*>(values.data());
    const std::span words(words_);  // a vector's ends would be read with each word
    for (std::atomic<std::uint64_t>& to : words) {
      std::uint64_t word;
      std::memcpy(&word, bytes, sizeof word);
      to.store(word, std::memory_order_release);  // not before the odd count
      bytes += sizeof word;
    }
    count_.store(before + 2, std::memory_order_release);
  }

  /// Any thread's: false when the writer got in between at every one of some attempts.
  /// @pre values.size() == size()
  [[nodiscard]] bool read(std::span<T> values) const noexcept {
    auto* bytes = reinterpret_cast<std::byte*>(values.data());
    for (int attempt = 0; attempt < kAttempts; ++attempt) {
      const std::uint64_t before = count_.load(std::memory_order_acquire);
      if (before % 2 != 0) continue;
      for (std::size_t i = 0; i < words_.size(); ++i) {
        const std::uint64_t word = words_[i].load(std::memory_order_acquire);
        std::memcpy(bytes + i * sizeof word, &word, sizeof word);
      }
      if (count_.load(std::memory_order_relaxed) == before) return true;
    }
    return false;
  }

 private:
  static constexpr int kAttempts = 10'000;
  std::size_t size_;
  alignas(64) std::atomic<std::uint64_t> count_{0};  // odd: a write is under way
  std::vector<std::atomic<std::uint64_t>> words_;
};

}  // namespace tandem
