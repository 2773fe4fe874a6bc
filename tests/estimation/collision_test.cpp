#include "estimation/collision.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

namespace tandem::estimation {
namespace {

TEST(CollisionWatch, FindsTheJointFurthestBeyondOnceUntilItWasQuiet) {
  CollisionWatch watch({1.0, 10.0, std::numeric_limits<double>::infinity()}, 3);
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
  const double threshold = learn_threshold(largest, 1.0, 6.0);
  int alarms = 0;
  constexpr int kHours = 50;
  for (int i = 0; i < 3600 * kHours; ++i) alarms += block() > threshold ? 1 : 0;
  std::printf("threshold %.2f deviations, %.2f alarms an hour for 6\n", threshold,
              static_cast<double>(alarms) / kHours);
  EXPECT_LT(alarms, 6 * kHours);  // maxima of normal samples have a lighter tail than Gumbel's
  EXPECT_GT(alarms, 0);
  EXPECT_GT(learn_threshold(largest, 1.0, 0.1), threshold);
}

TEST(LearnedThreshold, IsNeverBelowWhatWasSeen) {
  std::vector<double> largest(20, 1.0);
  largest[7] = 50.0;
  EXPECT_GE(learn_threshold(largest, 1.0, 3000.0), 50.0);
}

}  // namespace
}  // namespace tandem::estimation
