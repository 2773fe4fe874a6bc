// A counter that others look at while its one writer counts.
// Layer: base.  Thread: count_up() the writer's; seen() any.
#pragma once

#include <atomic>
#include <cstdint>

#include "base/realtime.hpp"

namespace tandem {

/// Plain loads and stores, but whole ones.
inline void count_up(std::uint64_t& counter) noexcept TANDEM_RT {
  std::atomic_ref(counter).store(counter + 1, std::memory_order_relaxed);
}
[[nodiscard]] inline std::uint64_t seen(const std::uint64_t& counter) noexcept {
  return std::atomic_ref(const_cast<std::uint64_t&>(counter)).load(std::memory_order_relaxed);
}

}  // namespace tandem
