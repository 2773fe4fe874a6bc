// The history against a naive one: every number that is handed out, and that none is missed.
#include "studio/history.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <random>
#include <vector>

namespace tandem::studio {
namespace {

constexpr float kNoNumber = std::numeric_limits<float>::quiet_NaN();
constexpr std::size_t kWidth = 5;

/// Every row that was added since the history began.
using Rows = std::map<std::uint64_t, std::vector<float>>;

bool equal(float a, float b) { return a == b || (std::isnan(a) && std::isnan(b)); }

/// What the window has to be, row by row, of cycles that are kept.
void expect_right(const History& history, const Rows& rows, const Window& window) {
  ASSERT_GT(window.rows, 0U);
  for (std::size_t s = 0; s < history.signals(); ++s) {
    std::vector<float> got(window.numbers());
    history.read(window, s, got);
    for (std::size_t r = 0; r < window.rows; ++r) {
      const std::uint64_t from = window.first_cycle + r * window.cycles;
      float low = kNoNumber, high = kNoNumber;
      for (auto row = rows.lower_bound(from);
           row != rows.end() && row->first < from + window.cycles; ++row) {
        low = std::fmin(low, row->second[s]);
        high = std::fmax(high, row->second[s]);
      }
      const std::size_t at = window.cycles == 1 ? r : 2 * r;
      EXPECT_TRUE(equal(got[at], low)) << "signal " << s << " row " << r << ": " << got[at]
                                       << ", not " << low << ", cycles " << window.cycles;
      if (window.cycles != 1) {
        EXPECT_TRUE(equal(got[at + 1], high))
            << "signal " << s << " row " << r << ": " << got[at + 1] << ", not " << high;
      }
    }
  }
}

TEST(StudioHistory, HandsOutWhatWasAddedWhateverWasLost) {
  std::mt19937 random(7);
  std::uniform_real_distribution<float> number(-10.0F, 10.0F);
  for (int round = 0; round < 40; ++round) {
    History history(4 * kWidth * 200, kWidth);  // 200 rows, then 100, of one cycle, 16 and 256
    Rows rows;
    std::uint64_t cycle = random() % 5000;
    const std::size_t count = 50 + random() % 4000;
    for (std::size_t i = 0; i < count; ++i) {
      cycle += random() % 40 == 0 ? 1 + random() % 300 : 1;  // some found no room in the ring
      std::vector<float> row(kWidth);
      for (float& one : row) one = random() % 10 == 0 ? kNoNumber : number(random);
      history.add(cycle, row);
      rows[cycle] = row;
    }
    for (int question = 0; question < 30; ++question) {
      const std::uint64_t first = rows.begin()->first;
      const std::uint64_t from = first + random() % (cycle - first + 1);
      const std::uint64_t to = from + random() % (cycle - from + 1);
      const std::size_t points = 1 + random() % 300;
      const Window window = history.plan(from, to, points);
      if (window.rows == 0) continue;  // older than what is kept
      EXPECT_LE(window.rows, 4 * points);
      EXPECT_LE(window.first_cycle / 256, std::max(from, window.first_cycle) / 256);
      // Rows at the ends may hold cycles beyond the span; older ones than are kept are NaN.
      const std::uint64_t span = kLevelCycles[window.level];
      const std::uint64_t oldest = cycle / span >= (span == 1 ? 199U : 99U)
                                       ? (cycle / span - (span == 1 ? 199U : 99U)) * span
                                       : 0;
      Rows kept(rows.lower_bound(oldest), rows.end());
      expect_right(history, kept, window);
    }
  }
}

TEST(StudioHistory, ShowsASpikeOfOneCycleAtEveryGrain) {
  History history(4 * 2'000, 1);
  constexpr std::uint64_t kSpike = 7'777;
  for (std::uint64_t cycle = 0; cycle < 9'000; ++cycle) {
    const float value = cycle == kSpike ? 5.0F : cycle == kSpike + 700 ? -3.0F : 0.5F;
    history.add(cycle, std::span(&value, 1));
  }
  for (const std::size_t points : {1U, 3U, 10U, 100U, 1'000U, 10'000U}) {
    for (const std::uint64_t from : {0U, 5'000U, 7'500U}) {
      const Window window = history.plan(from, 9'000, points);
      std::vector<float> numbers(window.numbers());
      history.read(window, 0, numbers);
      EXPECT_EQ(*std::ranges::max_element(numbers), 5.0F) << points << " points from " << from;
      EXPECT_EQ(*std::ranges::min_element(numbers), -3.0F) << points << " points from " << from;
    }
  }
}

TEST(StudioHistory, TakesTheFinestLevelThatGoesBackSoFar) {
  History history(4 * 1'000, 1);  // 1000 rows of a cycle, 500 of 16, 500 of 256
  for (std::uint64_t cycle = 0; cycle < 100'000; ++cycle) {
    const auto value = static_cast<float>(cycle);
    history.add(cycle, std::span(&value, 1));
  }
  EXPECT_EQ(history.plan(99'500, 99'999, 500).level, 0U);
  EXPECT_EQ(history.plan(99'500, 99'999, 500).rows, 500U);
  EXPECT_EQ(history.plan(93'000, 99'999, 500).level, 1U);
  EXPECT_EQ(history.plan(10'000, 99'999, 500).level, 2U);
  const Window merged = history.plan(10'000, 99'999, 20);
  EXPECT_EQ(merged.level, 2U);
  EXPECT_GT(merged.cycles, 256U);
  EXPECT_LE(merged.rows, 40U);
  EXPECT_GE(merged.rows, 20U);
  // 438 rows of 16 are too many for 100 points, 28 of 256 too few: the former are merged.
  const Window between = history.plan(93'000, 99'999, 100);
  EXPECT_EQ(between.level, 1U);
  EXPECT_EQ(between.cycles, 48U);
}

TEST(StudioHistory, HasNothingOfTimesThatWereNot) {
  History history(4 * 100, 1);
  EXPECT_EQ(history.plan(0, 10, 100).rows, 0U);
  const float value = 1.0F;
  for (std::uint64_t cycle = 50'000; cycle < 50'010; ++cycle) {
    history.add(cycle, std::span(&value, 1));
  }
  EXPECT_EQ(history.plan(0, 49'999, 100).rows, 0U);
  EXPECT_EQ(history.plan(50'010, 60'000, 100).rows, 0U);
  EXPECT_EQ(history.plan(10, 5, 100).rows, 0U);
  EXPECT_EQ(history.plan(0, 60'000, 100).rows, 10U);
}

TEST(StudioHistory, ForgetsWhatLayAfterWhereTimeGoesBackTo) {
  History history(4 * 4'000, 1);
  Rows rows;
  const auto add = [&](std::uint64_t cycle, float value) {
    history.add(cycle, std::span(&value, 1));
    rows.erase(rows.lower_bound(cycle), rows.end());
    rows[cycle] = {value};
  };
  for (std::uint64_t cycle = 0; cycle < 3'000; ++cycle) add(cycle, cycle < 2'500 ? 1.0F : 9.0F);
  for (const std::uint64_t to : {2'490U, 1'111U, 512U, 3U}) {
    for (std::uint64_t cycle = to; cycle < to + 300; ++cycle) add(cycle, -1.0F * float(to));
    for (const std::size_t points : {10'000U, 40U, 3U}) {
      const Window window = history.plan(0, 10'000, points);
      EXPECT_EQ((window.first_cycle + (window.rows - 1) * window.cycles) / window.cycles,
                (to + 299) / window.cycles);
      expect_right(history, rows, window);
    }
  }
}

TEST(StudioHistory, HasOfTheTimeBeforeItsFinestRowsWhatTheCoarserOnesHave) {
  History history(4 * 100, 1);  // 100 rows of a cycle, 50 of 16, 50 of 256
  float value = 1.0F;
  for (std::uint64_t cycle = 0; cycle < 700; ++cycle) history.add(cycle, std::span(&value, 1));
  value = 2.0F;
  for (std::uint64_t cycle = 325; cycle < 330; ++cycle) history.add(cycle, std::span(&value, 1));
  const Window fine = history.plan(326, 329, 100);
  EXPECT_EQ(fine.level, 0U);
  EXPECT_EQ(fine.rows, 4U);
  const Window all = history.plan(160, 329, 100);
  ASSERT_EQ(all.level, 1U) << "the single cycles before the jump have made room long ago";
  std::vector<float> numbers(all.numbers());
  history.read(all, 0, numbers);
  EXPECT_EQ(numbers[0], 1.0F);
  EXPECT_EQ(numbers[numbers.size() - 4], 1.0F) << "the row before the moment";
  EXPECT_EQ(numbers.back(), 2.0F) << "that of the moment begins anew";
}

TEST(StudioHistory, KeepsItsNewestRowsAndItsMemoryWhenSignalsCome) {
  std::mt19937 random(3);
  History history(4 * 2 * 300, 2);
  Rows rows;
  std::uint64_t cycle = 0;
  const auto add = [&](std::size_t width) {
    std::vector<float> row(width);
    for (float& one : row) one = static_cast<float>(random() % 1000);
    history.add(++cycle, row);
    row.resize(6, kNoNumber);
    rows[cycle] = row;
  };
  for (int i = 0; i < 700; ++i) add(2);
  history.widen(6);
  for (int i = 0; i < 20; ++i) add(6);
  const auto capacity = history.capacity_cycles();
  EXPECT_EQ(capacity[0], 100U);
  EXPECT_EQ(capacity[1], 50U * 16);
  const Window fine = history.plan(cycle - 99, cycle, 1'000);
  EXPECT_EQ(fine.rows, 100U);
  expect_right(history, rows, fine);
  const Window coarse = history.plan(16, cycle, 40);
  EXPECT_EQ(coarse.level, 1U);
  expect_right(history, rows, coarse);
}

}  // namespace
}  // namespace tandem::studio
