// CiA 402's homing methods against a carriage between two limit switches, from everywhere.
#include "firmware_emu/homing_search.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <vector>

namespace tandem::firmware {
namespace {

constexpr int kLow = -10'000;  // the limit switches close here, and further out
constexpr int kHigh = 10'000;
constexpr int kPitch = 700;  // of index pulses, one of which is at 0
constexpr int kFast = 90;    // counts in a step
constexpr int kSlow = 3;
/// After a turn the carriage moves on, and swings: steps along its old way.
constexpr std::array kSwing{20, 20, -20, -20, -20, -20, 20, 20};
constexpr int kOvershoot = 40;
constexpr int kSwingStep = 20;  // an edge may be met in it

struct Cam {
  int from, to;
};

struct Carriage {
  Cam cam{-300, 300};
  int at = 0;
  std::optional<int> home{};
  int furthest = 0;

  /// Until the search has ended. @return whether it found its home
  bool run(int method, int start) {
    HomingSearch search;
    search.begin(method);
    at = start;
    int before = at;
    std::size_t swings = kSwing.size();
    int swing_way = 0;
    for (int step = 0; step < 100'000; ++step) {
      const auto turn = [](int position) { return std::floor(position / double{kPitch}); };
      const double turns = turn(at) - turn(before);
      HomingSenses seen{.position = at,
                        .at_low_switch = at <= kLow,
                        .at_high_switch = at >= kHigh,
                        .at_home_switch = at >= cam.from && at <= cam.to,
                        .index = turns > 0.0   ? 1
                                 : turns < 0.0 ? -1
                                               : 0};
      const int direction = search.direction();
      const bool fast = !search.slow();
      switch (search.step(seen)) {
        case HomingSearch::Result::kFound: home = at; return true;
        case HomingSearch::Result::kFailed: home.reset(); return false;
        case HomingSearch::Result::kMoves: break;
      }
      if (search.turned() && fast && step > 0) {
        swings = 0;
        swing_way = direction;
      }
      before = at;
      if (swings < kSwing.size()) {
        at += swing_way * kSwing[swings++];
      } else {
        at += search.direction() * (search.slow() ? kSlow : kFast);
      }
      furthest = std::max(furthest, std::abs(at));
    }
    ADD_FAILURE() << "method " << method << " from " << start << " does not end";
    return false;
  }
};

/// The first pulse up or down from there.
double index_from(double edge, int way) {
  const double turns = edge / kPitch;
  return kPitch * (way > 0 ? std::floor(turns) + 1.0 : std::ceil(turns) - 1.0);
}

struct Row {
  int method;   ///< without index pulse; 16 less: with it
  double edge;  ///< where it is at home
  int way;      ///< to its index pulse
  Cam cam;
};

// IEC 61800-7-201, figures of the methods: which edge, and on which side of it the pulse is.
const std::vector<Row> kRows{{17, kLow, +1, {-300, 300}},     {18, kHigh, -1, {-300, 300}},
                             {19, 2000, -1, {2000, 20'000}},  {20, 2000, +1, {2000, 20'000}},
                             {21, 2000, +1, {-20'000, 2000}}, {22, 2000, -1, {-20'000, 2000}},
                             {23, -300, -1, {-300, 300}},     {24, -300, +1, {-300, 300}},
                             {25, 300, -1, {-300, 300}},      {26, 300, +1, {-300, 300}},
                             {27, 300, +1, {-300, 300}},      {28, 300, -1, {-300, 300}},
                             {29, -300, +1, {-300, 300}},     {30, -300, -1, {-300, 300}}};

TEST(HomingSearch, EndsAtItsEdgeWhereverItBegins) {
  for (const Row& row : kRows) {
    for (int start = kLow - 50; start <= kHigh + 50; start += 97) {
      Carriage carriage{.cam = row.cam};
      ASSERT_TRUE(carriage.run(row.method, start)) << row.method << " from " << start;
      EXPECT_NEAR(*carriage.home, row.edge, kSwingStep) << row.method << " from " << start;
      EXPECT_LE(carriage.furthest, kHigh + kFast + 2 * kOvershoot) << row.method;
    }
  }
}

TEST(HomingSearch, EndsAtTheFirstIndexPulseBehindTheEdge) {
  for (const Row& row : kRows) {
    for (int start = kLow - 50; start <= kHigh + 50; start += 97) {
      Carriage carriage{.cam = row.cam};
      const int method = row.method - 16;
      ASSERT_TRUE(carriage.run(method, start)) << method << " from " << start;
      EXPECT_NEAR(*carriage.home, index_from(row.edge, row.way), kSwingStep)
          << method << " from " << start;
    }
  }
}

TEST(HomingSearch, OfAnIndexPulseAloneGoesTheWayOfTheMethod) {
  for (int start = -5000; start <= 5000; start += 97) {
    Carriage carriage;
    ASSERT_TRUE(carriage.run(33, start));
    EXPECT_NEAR(*carriage.home, index_from(start, -1), kSlow) << start;
    ASSERT_TRUE(carriage.run(34, start));
    EXPECT_NEAR(*carriage.home, index_from(start, +1), kSlow) << start;
  }
}

TEST(HomingSearch, FailsBetweenTheLimitSwitchesWhereThereIsNoHomeSwitch) {
  for (int method = 1; method <= 34; ++method) {
    if (!HomingSearch::has(method)) continue;
    const int switches = method > 16 ? method - 16 : method;
    Carriage carriage{.cam = {1, 0}};
    EXPECT_EQ(carriage.run(method, 100), switches <= 2 || method >= 33) << method;
    EXPECT_LE(carriage.furthest, kHigh + kFast + 2 * kOvershoot) << method;
  }
}

TEST(HomingSearch, HasTheMethodsOfSwitchesAndIndexPulses) {
  std::vector<int> none;
  for (int method = -128; method <= 40; ++method) {
    if (method > 0 && !HomingSearch::has(method)) none.push_back(method);
    EXPECT_FALSE(method <= 0 && HomingSearch::has(method)) << method;
  }
  EXPECT_EQ(none, (std::vector{15, 16, 31, 32, 36, 38, 39, 40}));
}

}  // namespace
}  // namespace tandem::firmware
