// A clock whose time the test moves.
#pragma once

#include <algorithm>
#include <vector>

#include "rt/clock.hpp"

namespace tandem::rt {

class FakeClock final : public Clock {
 public:
  std::int64_t now = 1'000'000'000;
  std::int64_t wakeup_latency_ns = 0;
  std::vector<std::int64_t> sleeps;  // the deadlines asked for

  std::int64_t now_ns() noexcept TANDEM_RT override { return now; }
  void sleep_until(std::int64_t deadline_ns) noexcept override {
    sleeps.push_back(deadline_ns);
    if (deadline_ns > now) now = deadline_ns + wakeup_latency_ns;
  }
};

}  // namespace tandem::rt
