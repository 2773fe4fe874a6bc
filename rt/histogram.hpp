// A log-linear histogram of durations: fixed buckets, no heap, 3 % resolution.
// Layer: rt.  Thread: one writer; beside it others may ask for percentiles() and bins() alone.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "base/realtime.hpp"

namespace tandem::rt {

/// p50, p99, p99.9 and the maximum, all [ns].
struct Percentiles {
  std::int64_t p50 = 0;
  std::int64_t p99 = 0;
  std::int64_t p999 = 0;
  std::int64_t max = 0;
};

/// One bucket: how many values there were up to its upper end, and above the bucket before it.
struct HistogramBin {
  std::int64_t upper_ns = 0;
  std::uint64_t count = 0;
};

/// Counts of durations from 0 ns to 2^40 ns (18 minutes). Values below 64 ns are exact; above,
/// each power of two has 32 equal buckets. Longer ones count in the last bucket; the maximum is
/// exact.
class Histogram {
 public:
  void record(std::int64_t duration_ns) noexcept TANDEM_RT;

  [[nodiscard]] std::uint64_t count() const noexcept { return count_; }
  [[nodiscard]] std::int64_t max_ns() const noexcept { return max_ns_; }
  [[nodiscard]] std::int64_t sum_ns() const noexcept { return sum_ns_; }
  /// The upper end of the bucket that holds the smallest value v such that at least
  /// `fraction` (0 to 1) of the values are <= v; never more than the maximum. 0 when empty.
  [[nodiscard]] std::int64_t percentile_ns(double fraction) const noexcept;
  [[nodiscard]] Percentiles percentiles() const noexcept;

  /// Adds everything that `other` holds.
  void add(const Histogram& other) noexcept;
  /// The buckets that are not empty, the smallest first. Allocates.
  [[nodiscard]] std::vector<HistogramBin> bins() const;

 private:
  static constexpr unsigned kLinearBits = 5;  // 32 buckets per power of two
  static constexpr unsigned kTopBit = 40;
  static constexpr std::size_t kBuckets = (kTopBit - kLinearBits + 1) << kLinearBits;

  static std::size_t bucket_of(std::uint64_t value) noexcept TANDEM_RT;
  static std::int64_t upper_end(std::size_t bucket) noexcept;

  std::array<std::uint64_t, kBuckets> counts_{};
  std::uint64_t count_ = 0;
  std::int64_t sum_ns_ = 0;
  std::int64_t max_ns_ = 0;
};

}  // namespace tandem::rt
