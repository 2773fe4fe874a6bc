// Motions that come again, and what errors that come again do to intervals.
#include "identification/repeats.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "identification/estimate.hpp"

namespace tandem::identification {
namespace {

constexpr double kTurn = 2.0 * std::numbers::pi;

TEST(MotionPeriod, IsFoundBetweenRests) {
  std::vector<Signal> position(2);
  for (int k = 0; k < 30'000; ++k) {
    const double t = std::clamp(1e-3 * k - 1.0, 0.0, 24.16);
    position[0].push_back(std::sin(kTurn * t / 3.02) + 0.5 * std::cos(kTurn * 2.0 * t / 3.02));
    position[1].push_back(0.1 * std::sin(kTurn * 3.0 * t / 3.02));
  }
  EXPECT_NEAR(motion_period_s(position, 1e-3, 50), 3.02, 0.01);
}

TEST(MotionPeriod, IsNoneOfAMotionThatDoesNotRepeat) {
  std::vector<Signal> position(1);
  for (int k = 0; k < 20'000; ++k) position[0].push_back(std::sin(2e-7 * k * k));
  EXPECT_EQ(motion_period_s(position, 1e-3, 50), 0.0);
  EXPECT_EQ(motion_period_s({Signal(5000, 0.3)}, 1e-3, 50), 0.0);
}

// Refining went down to a period of 0 and never ended.
TEST(MotionPeriod, OfAFewStridesIsFound) {
  for (const double period_s : {0.1, 0.15, 0.2, 0.3}) {
    std::vector<Signal> position(1);
    for (int k = 0; k < 20'000; ++k)
      position[0].push_back(std::sin(kTurn * 1e-3 * k / period_s + 0.3));
    EXPECT_NEAR(motion_period_s(position, 1e-3, 50), period_s, 1e-9);
  }
}

TEST(MotionPeriod, IsFoundInALongLog) {
  std::vector<Signal> position(1);
  for (int k = 0; k < 300'000; ++k) position[0].push_back(std::sin(kTurn * 1e-3 * k / 7.31));
  EXPECT_NEAR(motion_period_s(position, 1e-3, 50), 7.31, 0.01);
}

/// Ten periods of 60 instants: errors that are new (0) or the same in each (1).
struct Errors {
  Eigen::VectorXd residual{600};
  std::vector<double> time_s;
  Errors(double same, std::uint64_t seed) {
    std::mt19937_64 random(seed);
    std::normal_distribution<double> normal;
    const Eigen::VectorXd again = Eigen::VectorXd::NullaryExpr(60, [&] { return normal(random); });
    for (Eigen::Index i = 0; i < 600; ++i) {
      residual[i] = std::sqrt(same) * again[i % 60] + std::sqrt(1.0 - same) * normal(random);
      time_s.push_back(0.05 * static_cast<double>(i));
    }
  }
};

TEST(RepeatFactor, IsTheNumberOfPeriodsWhereErrorsComeAgain) {
  double fresh = 0.0, half = 0.0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const auto factor = [&](double same) {
      const Errors errors(same, seed);
      return repeat_factor(errors.residual, errors.time_s, 3.0, 0.05, 4);
    };
    EXPECT_NEAR(factor(1.0), 10.0, 0.5);
    half += factor(0.5) / 20.0;
    fresh += factor(0.0) / 20.0;
  }
  EXPECT_NEAR(half, 5.5, 1.0);
  EXPECT_LT(fresh, 1.3);
  EXPECT_GE(fresh, 1.0);
}

// Quantised torques of a motion that repeats: as if every period was news, 20 periods gave
// intervals that held 30 of 100.
TEST(EstimateFromData, CountsErrorsThatComeAgainWithTheMotionOnce) {
  int inside = 0;
  for (std::uint64_t seed = 1; seed <= 100; ++seed) {
    std::mt19937_64 random(seed);
    std::normal_distribution<double> normal;
    Equations equations;
    equations.columns = 2;
    equations.first_of_log = {0};
    equations.repeats_s = {3.0};
    equations.stride_s = 0.05;
    equations.channels.resize(2);
    std::vector<double> error[2];
    std::vector<Eigen::Vector2d> motion;
    for (int i = 0; i < 60; ++i) {
      motion.emplace_back(normal(random), normal(random));
      for (auto& one : error) one.push_back(0.1 * normal(random));
    }
    for (std::size_t i = 0; i < 1200; ++i) {
      for (std::size_t c = 0; c < 2; ++c) {
        const double y = motion[i % 60].dot(Eigen::Vector2d(1.0, 2.0)) + error[c][i % 60];
        equations.channels[c].append(motion[i % 60], y, y, i);
      }
      equations.time_s.push_back(0.05 * static_cast<double>(i));
    }
    const Prior prior{Eigen::VectorXd::Zero(2), 1e-4 * Eigen::MatrixXd::Identity(2, 2)};
    const BaseParameters base{{0, 1}, Eigen::MatrixXd::Identity(2, 2)};
    const DataEstimate data =
        estimate_from_data(equations, std::vector<bool>(1200, true), prior, base);
    const double ci95 = data.quantile * std::sqrt(data.covariance(0, 0));
    inside += std::abs(data.mean[0] - 1.0) <= ci95 ? 1 : 0;
    EXPECT_LT(ci95, 0.06) << "0.1 / sqrt(120) is 0.009";
  }
  EXPECT_GE(inside, 88);
}

}  // namespace
}  // namespace tandem::identification
