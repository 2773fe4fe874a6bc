// Numbers over equal spans of time in few bytes: what comes out again.
#include "report/packing.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "tests/report/unpacked.hpp"

namespace tandem::report {
namespace {

constexpr float kNothing = std::numeric_limits<float>::quiet_NaN();

/// One signal of a kilohertz, of which `value` says each cycle, over spans of some cycles.
Spans spans_of(std::size_t cycles, std::size_t most_rows,
               const std::function<float(std::size_t)>& value) {
  const double end_s = 1e-3 * static_cast<double>(cycles - 1);
  Spans spans(Grid::over(0.0, end_s, 1e-3, most_rows), 1);
  for (std::size_t i = 0; i < cycles; ++i) {
    const auto row = spans.grid().row_of(1e-3 * static_cast<double>(i));
    EXPECT_TRUE(row) << i;
    if (row) spans.add(0, *row, value(i));
  }
  return spans;
}

TEST(Grid, HasTheFewestCyclesInARow) {
  EXPECT_EQ(Grid::over(0.0, 1.999, 1e-3, 2000).cycles, 1U);
  EXPECT_EQ(Grid::over(0.0, 1.999, 1e-3, 2000).rows, 2000U);
  const Grid grid = Grid::over(5.0, 15.0, 1e-3, 4000);
  EXPECT_EQ(grid.cycles, 3U);
  EXPECT_EQ(grid.rows, 3334U);
  EXPECT_EQ(grid.row_of(5.0), 0U);
  EXPECT_EQ(grid.row_of(5.0031), 1U);
  EXPECT_EQ(grid.row_of(15.0), 3333U);
  EXPECT_FALSE(grid.row_of(4.99));
  EXPECT_FALSE(grid.row_of(15.1));
  EXPECT_FALSE(grid.row_of(kNothing));
}

TEST(Packing, GivesNumbersBackWithin16BitsOfTheirRange) {
  const auto value = [](std::size_t i) {
    return static_cast<float>(30.0 + 12.0 * std::sin(0.01 * static_cast<double>(i)));
  };
  const auto all = unpacked(pack(spans_of(3000, 4000, value), 1));
  ASSERT_EQ(all.size(), 1U);
  ASSERT_EQ(all[0].least.size(), 3000U);
  const double half_step = 0.5 * 24.0 / 65534.0;
  for (std::size_t i = 0; i < 3000; ++i) ASSERT_NEAR(all[0].least[i], value(i), 1.01 * half_step);
}

TEST(Packing, KeepsASpikeOfOneCycleHoweverFewRowsThereAre) {
  const auto value = [](std::size_t i) {
    return i == 4321 ? 100.0F : i == 9876 ? -100.0F : std::sin(0.1F * static_cast<float>(i));
  };
  for (const std::size_t merge : {1, 3, 16}) {
    const Packed packed = pack(spans_of(20'000, 1000, value), merge);
    EXPECT_EQ(packed.grid.cycles, 20 * merge);
    const auto all = unpacked(packed);
    ASSERT_EQ(all.size(), 1U);
    const std::size_t high = 4321 / packed.grid.cycles, low = 9876 / packed.grid.cycles;
    EXPECT_NEAR(all[0].largest.at(high), 100.0, 0.002);
    EXPECT_NEAR(all[0].least.at(low), -100.0, 0.002);
    EXPECT_LT(all[0].largest.at(high + 1), 1.1);
    EXPECT_GT(all[0].least.at(low - 1), -1.1);
  }
}

TEST(Packing, KeepsGaps) {
  const auto value = [](std::size_t i) {
    return i >= 100 && i < 200 ? kNothing : static_cast<float>(i % 7);
  };
  for (const std::size_t merge : {1, 10}) {
    const auto all = unpacked(pack(spans_of(1000, 1000, value), merge));
    ASSERT_EQ(all.size(), 1U);
    for (std::size_t row = 0; row < all[0].least.size(); ++row) {
      const bool gap = row >= 100 / merge && row < 200 / merge;
      EXPECT_EQ(std::isnan(all[0].least[row]), gap) << row;
      EXPECT_EQ(std::isnan(all[0].largest[row]), gap) << row;
    }
  }
}

TEST(Packing, OfANumberThatNeverChangesIsTheNumber) {
  const Packed packed = pack(spans_of(1000, 100, [](auto) { return -0.25F; }), 1);
  EXPECT_EQ(std::get<double>(packed.signals.at(0)), -0.25);
  const Packed none = pack(spans_of(1000, 100, [](auto) { return kNothing; }), 1);
  EXPECT_TRUE(std::isnan(std::get<double>(none.signals.at(0))));
  const Packed endless = pack(spans_of(1000, 100, [](auto) { return INFINITY; }), 1);
  EXPECT_TRUE(std::isnan(std::get<double>(endless.signals.at(0)))) << "it has no number";
}

// A constant with a gap is no constant: its line would go through.
TEST(Packing, OfAConstantWithAGapHasTheGap) {
  const auto all =
      unpacked(pack(spans_of(10, 10, [](auto i) { return i == 5 ? kNothing : 2.5F; }), 1));
  EXPECT_TRUE(std::isnan(all.at(0).least.at(5)));
  EXPECT_EQ(all[0].least[4], 2.5);
}

TEST(Packing, GivesWholeNumbersBackAsTheyAre) {
  const std::function<float(std::size_t)> kinds[] = {
      [](std::size_t i) { return static_cast<float>(i / 37 % 9); },              // a mode
      [](std::size_t i) { return i % 11 == 0 ? 0.0F : 0x7310; },                 // a fault
      [](std::size_t i) { return static_cast<float>(10'000'000 + i * 1000); },   // a counter
      [](std::size_t i) { return -128.0F + static_cast<float>(i * 7 % 256); }};  // an i8
  for (const auto& value : kinds) {
    const auto all = unpacked(pack(spans_of(2000, 2000, value), 1));
    for (std::size_t i = 0; i < 2000; ++i) ASSERT_EQ(all.at(0).least[i], value(i)) << i;
  }
}

TEST(Packing, HoldsWhatIsSampledMoreSeldom) {
  const auto seldom = [](std::size_t i) {
    return i % 10 == 0 && i < 500 ? static_cast<float>(i) : kNothing;
  };
  Spans spans = spans_of(1000, 1000, seldom);
  spans.hold(0, 20);
  EXPECT_EQ(spans.least(0)[19], 10.0F);
  EXPECT_EQ(spans.least(0)[499], 490.0F);
  EXPECT_EQ(spans.least(0)[510], 490.0F);
  EXPECT_TRUE(std::isnan(spans.least(0)[511])) << "what lacks longer is a gap";
}

// RFC 4648, chapter 10.
TEST(Base64, IsTheOneOfTheStandard) {
  for (const auto& [text, code] :
       {std::pair{"", ""}, std::pair{"f", "Zg=="}, std::pair{"fo", "Zm8="},
        std::pair{"foo", "Zm9v"}, std::pair{"foob", "Zm9vYg=="}, std::pair{"fooba", "Zm9vYmE="},
        std::pair{"foobar", "Zm9vYmFy"}}) {
    EXPECT_EQ(base64(std::as_bytes(std::span(std::string_view(text)))), code);
  }
}

}  // namespace
}  // namespace tandem::report
