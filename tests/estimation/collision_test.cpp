#include "estimation/collision.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "estimation/alarm_curve.hpp"

namespace tandem::estimation {
namespace {

TEST(CollisionWatch, FindsTheJointFurthestBeyondOnceUntilItWasQuiet) {
  CollisionWatch watch({1.0, 10.0, std::numeric_limits<double>::infinity()}, 3, 3);
  std::vector<std::uint8_t> collided(3);
  EXPECT_FALSE(watch.look(std::vector{0.9, -9.0, 1e6}, collided));
  const auto found = watch.look(std::vector{-1.5, 30.0, 1e6}, collided);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->joint, 1U);
  EXPECT_EQ(found->torque_Nm, 30.0);
  EXPECT_EQ(collided, (std::vector<std::uint8_t>{1, 1, 0}));
  EXPECT_FALSE(watch.look(std::vector{-1.5, 30.0, 0.0}, collided)) << "the same collision";
  for (int quiet = 0; quiet < 3; ++quiet)
    EXPECT_FALSE(watch.look(std::vector{0.0, 0.0, 0.0}, collided));
  EXPECT_TRUE(watch.look(std::vector{2.0, 0.0, 0.0}, collided)) << "a new one";
}

// One push at the base was found three times within 6 ms, once for each channel.
TEST(CollisionWatch, FindsTheBaseOnceInAllOfItsChannels) {
  CollisionWatch watch({1.0, 1.0, 1.0, 1.0}, 2, 3);
  std::vector<std::uint8_t> collided(4);
  const auto found = watch.look(std::vector{0.0, 0.0, 2.0, 0.5}, collided);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->joint, 2U);
  EXPECT_FALSE(watch.look(std::vector{0.0, 0.0, 2.0, 1.5}, collided)) << "its other channel";
  EXPECT_EQ(collided, (std::vector<std::uint8_t>{0, 0, 1, 1}));
  EXPECT_TRUE(watch.look(std::vector{1.5, 0.0, 2.0, 1.5}, collided)) << "a joint is another place";
  for (int quiet = 0; quiet < 3; ++quiet)
    EXPECT_FALSE(watch.look(std::vector{0.0, 0.0, 0.0, 0.0}, collided));
  EXPECT_TRUE(watch.look(std::vector{0.0, 0.0, 0.0, 2.0}, collided));
}

// A threshold learned from ten minutes of a joint's noise: how often is it passed in 200 hours?
TEST(LearnedThreshold, IsPassedAsOftenAsItSays) {
  std::mt19937 random(1);
  std::normal_distribution<double> gauss;
  const auto block = [&] {  // the largest of a second at 100 Hz
    double most = 0.0;
    for (int i = 0; i < 100; ++i) most = std::max(most, std::abs(gauss(random)));
    return most;
  };
  std::vector<double> largest;
  for (int i = 0; i < 600; ++i) largest.push_back(block());
  const double threshold = learn_threshold({&largest, 1}, 1.0, 6.0);
  int alarms = 0;
  constexpr int kHours = 50;
  for (int i = 0; i < 3600 * kHours; ++i) alarms += block() > threshold ? 1 : 0;
  std::printf("threshold %.2f deviations, %.2f alarms an hour for 6\n", threshold,
              static_cast<double>(alarms) / kHours);
  EXPECT_LT(alarms, 6 * kHours);  // maxima of normal samples have a lighter tail than Gumbel's
  EXPECT_GT(alarms, 0);
  EXPECT_GT(learn_threshold({&largest, 1}, 1.0, 0.1), threshold);
}

// Runs in which a joint sticks, and one in which it slips all the time, as COMAN's waist does.
TEST(LearnedThreshold, HoldsWhereFewOfTheRunsSlip) {
  std::mt19937 random(1);
  std::normal_distribution<double> gauss;
  const auto run_of = [&](double mean, double deviation, int blocks) {
    std::vector<double> run;
    for (int i = 0; i < blocks; ++i) run.push_back(mean + deviation * std::abs(gauss(random)));
    return run;
  };
  std::vector<std::vector<double>> runs(9, std::vector<double>());
  for (auto& run : runs) run = run_of(0.6, 0.1, 40);
  runs.push_back(run_of(1.0, 0.4, 40));
  const double threshold = learn_threshold(runs, 0.5, 1.0);
  const std::vector<double> slips = run_of(1.0, 0.4, 7200 * 20);  // 20 h
  EXPECT_LT(std::ranges::count_if(slips, [&](double t) { return t > threshold; }), 20);
  EXPECT_LT(learn_threshold({runs.data(), 9}, 0.5, 1.0), threshold);
}

TEST(FalseAlarms, AreBlocksInWhichAJointIsBeyond) {
  FalseAlarms alarms(std::vector{1.0, 10.0}, 5);
  for (int run = 0; run < 2; ++run) {
    alarms.begin_run();
    for (int i = 0; i < 13; ++i) alarms.look(std::vector{i == 7 ? -1.5 : 0.1, i < 5 ? 8.0 : 0.0});
  }
  EXPECT_EQ(alarms.cycles(), 20U) << "two blocks a run; what is left is not counted";
  EXPECT_EQ(alarms.alarms(1.0), 2U);
  EXPECT_EQ(alarms.alarms(0.7), 4U);
  EXPECT_EQ(alarms.alarms(2.0), 0U);
}

TEST(DetectionTimes, CountFromThePushesFirstCycle) {
  DetectionTimes times(std::vector{1.0, 10.0}, std::vector{0.5, 1.0, 4.0});
  for (const double rate : {0.1, 0.3, 0.9}) {  // Nm a cycle
    times.begin_push();
    for (int i = 1; i <= 10; ++i) times.look(std::vector{-rate * i, 0.0});
  }
  const DetectionTimes::Summary half = times.with(0);
  EXPECT_EQ(half.pushes, 3U);
  EXPECT_EQ(half.found, 3U);
  EXPECT_EQ(half.median, 2.0);
  EXPECT_EQ(half.worst, 6.0);
  EXPECT_EQ(times.with(2).found, 1U);
  EXPECT_TRUE(std::isinf(times.with(2).median));
}

TEST(LearnedThreshold, IsNeverBelowWhatWasSeen) {
  std::vector<double> largest(20, 1.0);
  largest[7] = 50.0;
  EXPECT_GE(learn_threshold({&largest, 1}, 1.0, 3000.0), 50.0);
}

}  // namespace
}  // namespace tandem::estimation
