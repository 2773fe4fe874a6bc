// Bucket of a value, and back: the leading 1 bit and the bits below it, as in HdrHistogram.
#include "rt/histogram.hpp"

#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>

namespace tandem::rt {
namespace {

/// Others read while the one writer counts: plain loads and stores, but whole ones.
template <class Number>
Number look(const Number& number) noexcept {
  return std::atomic_ref<Number>(const_cast<Number&>(number)).load(std::memory_order_relaxed);
}
template <class Number>
void set(Number& number, Number value) noexcept TANDEM_RT {
  std::atomic_ref<Number>(number).store(value, std::memory_order_relaxed);
}

}  // namespace

std::size_t Histogram::bucket_of(std::uint64_t value) noexcept TANDEM_RT {
  // The bucket is the value's leading 1 and the kLinearBits bits after it.
  const unsigned width = static_cast<unsigned>(std::bit_width(value));
  const unsigned shift = width > kLinearBits + 1 ? width - kLinearBits - 1 : 0;
  return std::min<std::size_t>((std::size_t{shift} << kLinearBits) + (value >> shift),
                               kBuckets - 1);
}

std::int64_t Histogram::upper_end(std::size_t bucket) noexcept {
  constexpr std::size_t kLinear = std::size_t{1} << kLinearBits;
  if (bucket < 2 * kLinear) return static_cast<std::int64_t>(bucket);
  const std::size_t shift = (bucket >> kLinearBits) - 1;
  const std::size_t mantissa = bucket - (shift << kLinearBits);
  return static_cast<std::int64_t>(((mantissa + 1) << shift) - 1);
}

void Histogram::record(std::int64_t duration_ns) noexcept TANDEM_RT {
  const std::int64_t value = std::max<std::int64_t>(duration_ns, 0);
  std::uint64_t& count = counts_[bucket_of(static_cast<std::uint64_t>(value))];
  set(count, count + 1);
  set(count_, count_ + 1);
  set(sum_ns_, sum_ns_ + value);
  if (value > max_ns_) set(max_ns_, value);
}

std::int64_t Histogram::percentile_ns(double fraction) const noexcept {
  const std::int64_t max_ns = look(max_ns_);
  const auto wanted =
      static_cast<std::uint64_t>(std::ceil(fraction * static_cast<double>(look(count_))));
  std::uint64_t seen = 0;
  for (std::size_t bucket = 0; bucket < kBuckets; ++bucket) {
    seen += look(counts_[bucket]);
    if (seen >= wanted && seen > 0) return std::min(upper_end(bucket), max_ns);
  }
  return max_ns;
}

Percentiles Histogram::percentiles() const noexcept {
  return {percentile_ns(0.5), percentile_ns(0.99), percentile_ns(0.999), look(max_ns_)};
}

void Histogram::add(const Histogram& other) noexcept {
  for (std::size_t bucket = 0; bucket < kBuckets; ++bucket) {
    counts_[bucket] += other.counts_[bucket];
  }
  count_ += other.count_;
  sum_ns_ += other.sum_ns_;
  max_ns_ = std::max(max_ns_, other.max_ns_);
}

std::vector<HistogramBin> Histogram::bins() const {
  std::vector<HistogramBin> out;
  for (std::size_t bucket = 0; bucket < kBuckets; ++bucket) {
    const std::uint64_t count = look(counts_[bucket]);
    if (count > 0) out.push_back({upper_end(bucket), count});
  }
  return out;
}

}  // namespace tandem::rt
