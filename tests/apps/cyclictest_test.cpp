// cyclictest's histogram, read from the JSON that its version 2.40 writes.
#include "apps/machine/cyclictest.hpp"

#include <gtest/gtest.h>

#include <algorithm>

namespace tandem::apps {
namespace {

constexpr char kJson[] = R"({
  "file_version": 1,
  "rt_test_version:": "2.40",
  "num_threads": 1,
  "thread": {
    "0": {
      "histogram": { "100": 1, "12": 6, "9": 2 },
      "cycles": 10,
      "min": 9, "max": 250000, "avg": 28.78, "cpu": 1, "node": 0
    }
  }
})";

TEST(Cyclictest, SortsItsHistogramAndCountsTheOverflowAtTheMaximum) {
  const auto result = read_cyclictest(kJson);
  ASSERT_TRUE(result) << result.error().to_string();
  ASSERT_EQ(result->bins.size(), 4U);
  EXPECT_EQ(result->bins[0].upper_ns, 9'000);
  EXPECT_EQ(result->bins[0].count, 2U);
  EXPECT_EQ(result->bins[1].upper_ns, 12'000);
  EXPECT_EQ(result->bins[2].upper_ns, 100'000);
  EXPECT_EQ(result->bins[3].upper_ns, 250'000'000);
  EXPECT_EQ(result->bins[3].count, 1U);
  EXPECT_EQ(result->cycles, 10U);
}

TEST(Cyclictest, GivesPercentiles) {
  const auto result = read_cyclictest(kJson);
  ASSERT_TRUE(result);
  EXPECT_EQ(result->percentile_ns(0.2), 9'000);
  EXPECT_EQ(result->percentile_ns(0.21), 12'000);
  EXPECT_EQ(result->percentiles().p50, 12'000);
  EXPECT_EQ(result->percentiles().p99, 250'000'000);
  EXPECT_EQ(result->percentiles().max, 250'000'000);
}

TEST(Cyclictest, AddsSlices) {
  auto sum = read_cyclictest(kJson);
  ASSERT_TRUE(sum);
  sum->add(
      *read_cyclictest(R"({"thread":{"0":{"histogram":{"12":1,"13":1},"cycles":2,"max":13}}})"));
  EXPECT_EQ(sum->cycles, 12U);
  EXPECT_EQ(sum->bins[1].count, 7U);
  EXPECT_EQ(sum->bins[2].upper_ns, 13'000);
  EXPECT_EQ(sum->max_ns, 250'000'000);
}

TEST(Cyclictest, RefusesWhatIsNotItsJson) {
  for (const char* text : {"", "{", "{}", "[]", R"({"thread": {"0": {"cycles": 3, "max": 2}}})",
                           R"({"thread":{"0":{"histogram":{"x":1},"cycles":1,"max":1}}})",
                           R"({"thread":{"0":{"histogram":{"1":"a"},"cycles":1,"max":1}}})"}) {
    EXPECT_FALSE(read_cyclictest(text)) << text;
  }
}

TEST(Cyclictest, IsStartedWithOurPeriodPriorityAndPolicy) {
  const auto command = cyclictest_command({.period_us = 500,
                                           .cycles = 2000,
                                           .policy = rt::SchedulingPolicy::kRoundRobin,
                                           .priority = 42,
                                           .cpu = 3,
                                           .json = "/tmp/x.json"});
  for (const char* argument : {"--interval=500", "--loops=2000", "--policy=rr", "--priority=42",
                               "--affinity=3", "--json=/tmp/x.json"}) {
    EXPECT_EQ(std::ranges::count(command, argument), 1) << argument;
  }
}

}  // namespace
}  // namespace tandem::apps
