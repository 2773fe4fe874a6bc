// Series that start and end at rest, and the filter that signals pass.
#include "identification/series.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "identification/low_pass.hpp"

namespace tandem::identification {
namespace {

TEST(Series, StartsAndEndsAtRestAndIsItsOwnDerivative) {
  std::uint64_t seed = 5;
  const ExcitingSeries series = random_series(Eigen::Vector3d(0.1, -0.2, 0.3), 5, 8.0, seed);
  for (const double t : {0.0, 8.0, 16.0}) {
    const ExcitingSeries::State now = series.at(t);
    EXPECT_LT((now.x - series.start).norm(), 1e-12);
    EXPECT_LT(now.v.norm(), 1e-12);
    EXPECT_LT(now.acceleration.norm(), 1e-12);
  }
  for (const double t : {0.7, 3.3, 6.1}) {
    const double h = 1e-5;
    const ExcitingSeries::State before = series.at(t - h), now = series.at(t),
                                after = series.at(t + h);
    EXPECT_LT((now.v - (after.x - before.x) / (2 * h)).norm(), 1e-7);
    EXPECT_LT((now.acceleration - (after.v - before.v) / (2 * h)).norm(), 1e-7);
    EXPECT_GT(now.v.norm(), 1e-3);
  }
}

TEST(Series, IsFoundAgainFromItsValues) {
  std::uint64_t seed = 6;
  const ExcitingSeries series = random_series(Eigen::Vector2d(0.4, 0.0), 4, 10.0, seed);
  Eigen::MatrixXd values(64, 2);
  for (int k = 0; k < 64; ++k) values.row(k) = series.at(10.0 * k / 64).x.transpose();
  const ExcitingSeries found = series_through(values, 6, 10.0);
  EXPECT_LT((found.a.topRows(4) - series.a).norm(), 1e-12);
  EXPECT_LT((found.b.topRows(4) - series.b).norm(), 1e-12);
  EXPECT_LT(found.a.bottomRows(2).norm(), 1e-12);
}

TEST(LowPass, PassesWhatIsSlowWithoutAShiftAndStopsWhatIsFast) {
  constexpr double kPeriod_s = 1e-3;
  const LowPass filter(kPeriod_s, 10.0);
  const auto sine = [](double frequency_Hz) {
    std::vector<double> signal(3000);
    for (std::size_t i = 0; i < signal.size(); ++i)
      signal[i] = std::sin(2.0 * std::numbers::pi * frequency_Hz * 1e-3 * static_cast<double>(i));
    return signal;
  };
  for (const double frequency_Hz : {0.2, 1.0, 3.0, 6.0}) {
    const std::vector<double> signal = sine(frequency_Hz);
    const double w = 2.0 * std::numbers::pi * frequency_Hz;
    for (const std::size_t at : {1200U, 1511U, 1733U}) {
      const double phase = w * 1e-3 * static_cast<double>(at);
      EXPECT_NEAR(filter.value(signal, at), std::sin(phase), 2e-4);
      EXPECT_NEAR(filter.rate(signal, at), w * std::cos(phase), 4e-4 * w);
      EXPECT_NEAR(filter.second_rate(signal, at), -w * w * std::sin(phase), 4e-4 * w * w);
    }
  }
  const std::vector<double> fast = sine(20.0);
  EXPECT_NEAR(filter.value(fast, 1500), 0.0, 2e-4);
  EXPECT_EQ(filter.stride(), 50U);
}

TEST(LowPass, SaysNothingNearAHole) {
  const LowPass filter(1e-3, 10.0);
  std::vector<double> signal(3000, 1.0);
  signal[1500] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(std::isnan(filter.value(signal, 1500 + filter.reach())));
  EXPECT_NEAR(filter.value(signal, 1501 + filter.reach()), 1.0, 1e-12);
}

}  // namespace
}  // namespace tandem::identification
