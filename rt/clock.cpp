// CLOCK_MONOTONIC read and slept on by absolute deadlines, so that errors do not add up.
#include "rt/clock.hpp"

#include <cerrno>
#include <ctime>

#include "base/clock_ns.hpp"
#include "rt/doorbell.hpp"
#include "rt/stop_signal.hpp"

namespace tandem::rt {

void Clock::sleep_until_rung(std::int64_t deadline_ns, const Doorbell&, std::uint32_t) noexcept {
  sleep_until(deadline_ns);
}

std::int64_t WallClock::now_ns() noexcept TANDEM_RT { return clock_ns(CLOCK_MONOTONIC); }

void WallClock::sleep_until(std::int64_t deadline_ns) noexcept {
  const timespec until{.tv_sec = deadline_ns / kSecond_ns, .tv_nsec = deadline_ns % kSecond_ns};
  while (::clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, nullptr) == EINTR) {
    if (stop_requested()) return;
  }
}

void WallClock::sleep_until_rung(std::int64_t deadline_ns, const Doorbell& bell,
                                 std::uint32_t seen) noexcept {
  bell.wait(seen, deadline_ns);
}

}  // namespace tandem::rt
