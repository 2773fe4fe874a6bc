// An atomic counter that rings by FUTEX_WAKE; the loop waits for it to change, to a deadline.
#include "rt/doorbell.hpp"

#include <linux/futex.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <climits>
#include <ctime>

#include "base/clock_ns.hpp"
#include "rt/clock.hpp"

namespace tandem::rt {
namespace {

/// A signal only sets a flag, and mostly on another thread: it wakes nobody.
constexpr std::int64_t kPatience_ns = 20'000'000;

}  // namespace

void Doorbell::ring() noexcept {
  count_.fetch_add(1, std::memory_order_release);
  ::syscall(SYS_futex, &count_, FUTEX_WAKE_PRIVATE, INT_MAX, nullptr, nullptr, 0);
}

void Doorbell::end() noexcept {
  ended_.store(true, std::memory_order_relaxed);
  ring();
}

void Doorbell::wait(std::uint32_t seen, std::int64_t deadline_ns) const noexcept {
  while (count() == seen && !stop_requested()) {
    const std::int64_t now_ns = clock_ns(CLOCK_MONOTONIC);
    if (now_ns >= deadline_ns) return;
    const std::int64_t until_ns = std::min(deadline_ns, now_ns + kPatience_ns);
    const timespec until{.tv_sec = until_ns / kSecond_ns, .tv_nsec = until_ns % kSecond_ns};
    // FUTEX_WAIT_BITSET: an absolute time on CLOCK_MONOTONIC.
    ::syscall(SYS_futex, &count_, FUTEX_WAIT_BITSET_PRIVATE, seen, &until, nullptr,
              FUTEX_BITSET_MATCH_ANY);
  }
}

}  // namespace tandem::rt
