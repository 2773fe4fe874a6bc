// A reference under bounds of velocity, acceleration and jerk, against its definition: differences.
#include "hal/reference_motion.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>
#include <vector>

namespace tandem::hal {
namespace {

constexpr double kPeriod_s = 1e-3;
constexpr double kUnbounded = std::numeric_limits<double>::infinity();

struct Extremes {
  double velocity = 0.0, acceleration = 0.0, jerk = 0.0, min = kUnbounded, max = -kUnbounded;
};

/// Steps a motion and looks at nothing but the positions that it gives.
class Bench {
 public:
  explicit Bench(const MotionBounds& of, double from = 0.0) : bounds(of), last_{from, 0.0, 0.0} {
    motion.begin(from);
  }
  double step(double wanted) {
    const double now = motion.step(std::clamp(wanted, bounds.min, bounds.max), bounds, kPeriod_s);
    const double velocity = (now - last_[0]) / kPeriod_s;
    const double acceleration = (velocity - last_[1]) / kPeriod_s;
    const double jerk = (acceleration - last_[2]) / kPeriod_s;
    most.velocity = std::max(most.velocity, std::abs(velocity));
    most.acceleration = std::max(most.acceleration, std::abs(acceleration));
    most.jerk = std::max(most.jerk, std::abs(jerk));
    most.min = std::min(most.min, now);
    most.max = std::max(most.max, now);
    last_[0] = now;
    last_[1] = velocity;
    last_[2] = acceleration;
    return now;
  }
  void expect_kept() const {
    EXPECT_LE(most.velocity, bounds.velocity * (1.0 + 1e-6) + 1e-9);
    EXPECT_LE(most.acceleration, bounds.acceleration * (1.0 + 1e-6) + 1e-7);
    if (std::isfinite(bounds.jerk)) {
      EXPECT_LE(most.jerk, bounds.jerk * (1.0 + 1e-3) + 0.1);
    }
    EXPECT_GE(most.min, bounds.min - 1e-9);
    EXPECT_LE(most.max, bounds.max + 1e-9);
  }

  MotionBounds bounds;
  ReferenceMotion motion;
  Extremes most;

 private:
  double last_[3];
};

/// Bounds with and without jerk.
class Bounds : public testing::TestWithParam<double> {
 protected:
  MotionBounds bounds{
      .min = -1.0, .max = 1.0, .velocity = 2.0, .acceleration = 10.0, .jerk = GetParam()};
};

TEST_P(Bounds, LetAMotionThatKeepsThemPassUnchanged) {
  Bench bench(bounds);
  const double w = 2.0;  // at most 1.9 rad/s, 9.6 rad/s^2, 62 rad/s^3
  for (int i = 0; i < 4000; ++i) {
    const double wanted = 0.8 * std::pow(std::sin(w * i * kPeriod_s), 3);
    ASSERT_EQ(bench.step(wanted), wanted) << i;
  }
}

TEST_P(Bounds, AreKeptByAStepWhichArrivesExactlyAndInTime) {
  for (const double to : {0.9, -0.9, 0.3, 0.01, 1e-4, 1e-7, 1.0}) {
    Bench bench(bounds);
    int steps = 0;
    while (bench.step(to) != to || bench.step(to) != to) ASSERT_LT(++steps, 4000) << to;
    bench.expect_kept();
    const double step = std::isfinite(bounds.jerk) ? bounds.jerk * std::pow(kPeriod_s, 3) : 1e-9;
    EXPECT_LE(std::max(bench.most.max, -bench.most.min), std::abs(to) + step) << "overshoot";
    // Rest to rest without jerk: V/A + d/V, or twice sqrt(d/A); jerk costs A/J at most twice.
    const double d = std::abs(to), v = bounds.velocity, a = bounds.acceleration;
    const double jerk_s = std::isfinite(bounds.jerk) ? 2.0 * a / bounds.jerk : 0.0;
    const double least_s = d > v * v / a ? v / a + d / v : 2.0 * std::sqrt(d / a);
    const double jerky_s =
        std::isfinite(bounds.jerk) ? 4.0 * std::cbrt(d / (2.0 * bounds.jerk)) : 0;
    EXPECT_LE(steps * kPeriod_s, std::max(least_s, jerky_s) + jerk_s + 0.03) << to;
  }
}

TEST_P(Bounds, AreKeptByAnythingAndTheReferenceIsMetAgain) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> anywhere(-1.5, 1.5), often(0.0, 1.0);
  for (int trial = 0; trial < 50; ++trial) {
    Bench bench(bounds);
    double wanted = 0.0;
    for (int i = 0; i < 3000; ++i) {
      if (often(random) < 0.01) wanted = anywhere(random);
      if (often(random) < 0.3) wanted += 1e-3 * anywhere(random);
      (void)bench.step(wanted);
    }
    bench.expect_kept();
    wanted = std::clamp(wanted, -1.0, 1.0);
    for (int i = 0; i < 3000; ++i) (void)bench.step(wanted);
    EXPECT_EQ(bench.step(wanted), wanted);
  }
}

TEST_P(Bounds, BrakeBeforeTheEndOfTheRange) {
  Bench bench(bounds);
  for (int i = 0; i < 3000; ++i) (void)bench.step(1.9 * i * kPeriod_s - 0.9);  // does not brake
  bench.expect_kept();
  EXPECT_EQ(bench.step(9.0), 1.0);
}

TEST_P(Bounds, CatchUpWithAReferenceThatGoesOn) {
  Bench bench(bounds, -0.9);
  double wanted = -0.5;  // a step, then a steady motion
  int met = -1;
  for (int i = 0; i < 1500; ++i) {
    wanted += 0.5 * kPeriod_s;
    if (bench.step(wanted) == wanted && met < 0) met = i;
  }
  bench.expect_kept();
  EXPECT_GT(met, 0);
  EXPECT_LT(met, 800);
}

TEST_P(Bounds, LeadBackFromOutsideTheRange) {
  Bench bench(bounds, 1.4);
  for (int i = 0; i < 2000; ++i) (void)bench.step(1.0);
  EXPECT_EQ(bench.step(1.0), 1.0);
  EXPECT_LE(bench.most.acceleration, 10.0 * (1 + 1e-6));
  EXPECT_LE(bench.most.max, 1.4);
}

INSTANTIATE_TEST_SUITE_P(Of, Bounds, testing::Values(kUnbounded, 1000.0, 100.0),
                         [](const auto& jerk) {
                           return std::isfinite(jerk.param)
                                      ? "Jerk" + std::to_string(static_cast<int>(jerk.param))
                                      : std::string("Acceleration");
                         });

/// Against the integral of the braking, in steps of a microsecond.
TEST(StoppingDistance, IsThatOfTheBraking) {
  const MotionBounds bounds{.acceleration = 4.0, .jerk = 50.0};
  for (const double velocity : {0.0, 0.1, 1.0, -2.0}) {
    for (const double acceleration : {0.0, 4.0, -4.0, 1.5}) {
      double x = 0.0, v = velocity, a = acceleration;
      const double dt = 1e-6;
      const double settled = v + a * std::abs(a) / (2.0 * bounds.jerk);
      const double side = settled < 0.0 ? -1.0 : 1.0;
      bool back = false;  // the acceleration goes back to nothing
      for (int i = 0; i < 5'000'000 && !(back && side * a >= 0.0); ++i) {
        back = back || side * v <= a * a / (2.0 * bounds.jerk);
        if (side * a > 0.0) back = false;
        a += side * (back ? 1.0 : -1.0) * bounds.jerk * dt;
        a = std::clamp(a, -bounds.acceleration, bounds.acceleration);
        v += a * dt;
        x += v * dt;
      }
      EXPECT_NEAR(stopping_distance(velocity, acceleration, bounds), x, 1e-4)
          << velocity << " " << acceleration;
    }
  }
}

}  // namespace
}  // namespace tandem::hal
