// How often something may be asked for: a few at once, then so many a second.
// Layer: apps/control.  Thread: one at a time.
#pragma once

#include <algorithm>
#include <cstdint>

namespace tandem::apps {

/// A token bucket that is full at first. No clock: the time is the caller's.
class RateLimit {
 public:
  /// @param per_second  at least 1: as many are let through at once, then one each 1 / per_second
  explicit constexpr RateLimit(std::int64_t per_second)
      : each_ns_(1'000'000'000 / per_second), full_ns_(each_ns_ * per_second) {}

  /// Whether one more may be asked for; one that may not does not count.
  /// @param now_ns  of a clock that does not go back
  [[nodiscard]] constexpr bool take(std::int64_t now_ns) {
    const std::int64_t begin_ns = std::max(free_ns_, now_ns - full_ns_);
    if (begin_ns + each_ns_ > now_ns) return false;
    free_ns_ = begin_ns + each_ns_;
    return true;
  }

 private:
  std::int64_t each_ns_, full_ns_;
  std::int64_t free_ns_ = INT64_MIN / 2;  // what lies between it and now is not used yet
};

}  // namespace tandem::apps
