#include "rt/histogram.hpp"

#include <algorithm>
#include <cmath>
#include <random>
#include <thread>

namespace tandem::rt {
namespace {

TEST(Histogram, IsExactBelow64Nanoseconds) {
  Histogram histogram;
  for (int value = 0; value < 64; ++value) histogram.record(value);
  EXPECT_EQ(histogram.percentile_ns(0.5), 31);
  EXPECT_EQ(histogram.percentile_ns(1.0), 63);
}

TEST(Histogram, GivesPercentilesWithinThreePercentOfTheSortedValues) {
  std::mt19937_64 random(7);
  std::lognormal_distribution<double> spread(11.0, 1.5);
  Histogram histogram;
  std::vector<std::int64_t> values;
  for (int i = 0; i < 20'000; ++i) {
    values.push_back(static_cast<std::int64_t>(spread(random)));
    histogram.record(values.back());
  }
  std::sort(values.begin(), values.end());
  for (const double fraction : {0.01, 0.5, 0.9, 0.99, 0.999}) {
    const auto rank = static_cast<std::size_t>(std::ceil(fraction * 20'000.0)) - 1;
    const auto exact = static_cast<double>(values[rank]);
    const auto found = static_cast<double>(histogram.percentile_ns(fraction));
    EXPECT_GE(found, exact) << fraction;
    EXPECT_LE(found, exact * (1.0 + 1.0 / 32.0)) << fraction;
  }
  const Percentiles all = histogram.percentiles();
  EXPECT_EQ(all.max, values.back());
  EXPECT_LE(all.p50, all.p99);
  EXPECT_LE(all.p99, all.p999);
  EXPECT_LE(all.p999, all.max);
}

TEST(Histogram, CountsTooLongAndNegativeDurationsInItsEndBuckets) {
  Histogram histogram;
  histogram.record(-5);
  EXPECT_EQ(histogram.percentile_ns(1.0), 0);
  const std::int64_t hour = 3'600'000'000'000;
  histogram.record(hour);
  EXPECT_EQ(histogram.count(), 2U);
  EXPECT_EQ(histogram.max_ns(), hour);
  EXPECT_GE(histogram.percentile_ns(1.0), (std::int64_t{1} << 40) - 1);
}

TEST(Histogram, IsZeroWhenEmpty) {
  const Percentiles none = Histogram{}.percentiles();
  EXPECT_EQ(none.p50, 0);
  EXPECT_EQ(none.p999, 0);
  EXPECT_EQ(none.max, 0);
}

TEST(Histogram, GivesItsBucketsAndAddsAnother) {
  Histogram a;
  Histogram b;
  for (const std::int64_t value : {3, 3, 5}) a.record(value);
  for (const std::int64_t value : {5, 1'000'000}) b.record(value);
  a.add(b);
  const auto bins = a.bins();
  ASSERT_EQ(bins.size(), 3U);
  EXPECT_EQ(bins[0].upper_ns, 3);
  EXPECT_EQ(bins[0].count, 2U);
  EXPECT_EQ(bins[1].upper_ns, 5);
  EXPECT_EQ(bins[1].count, 2U);
  EXPECT_GE(bins[2].upper_ns, 1'000'000);
  EXPECT_LE(bins[2].upper_ns, 1'031'250);
  EXPECT_EQ(a.count(), 5U);
  EXPECT_EQ(a.sum_ns(), 1'000'016);
  EXPECT_EQ(a.max_ns(), 1'000'000);
}

TEST(Histogram, GivesItsBucketsWhileItsWriterCounts) {
  Histogram histogram;
  std::jthread writer([&](const std::stop_token& end) {
    while (!end.stop_requested()) histogram.record(1000);
  });
  std::uint64_t before = 0;
  for (int look = 0; look < 1000; ++look) {
    const auto bins = histogram.bins();
    ASSERT_LE(bins.size(), 1U);
    const std::uint64_t now = bins.empty() ? 0 : bins[0].count;
    EXPECT_GE(now, before);
    before = now;
  }
}

}  // namespace
}  // namespace tandem::rt
