#include "firmware_emu/estimator.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <limits>
#include <numbers>

namespace tandem::firmware {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kT = 1.0e-3;

TEST(Encoder, RoundsToTheNearestCount) {
  Encoder encoder(1000.0);
  const double count = 2.0 * kPi / 1000.0;
  EXPECT_TRUE(encoder.sample(10.4 * count));
  EXPECT_EQ(encoder.counts(), 10);
  EXPECT_TRUE(encoder.sample(-10.6 * count));
  EXPECT_EQ(encoder.counts(), -11);
  EXPECT_DOUBLE_EQ(encoder.position_rad(), -11.0 * count);
}

TEST(Encoder, KeepsItsCountWhenTheAngleIsNoNumberOrTooFar) {
  Encoder encoder(1000.0);
  ASSERT_TRUE(encoder.sample(1.0));
  const std::int64_t before = encoder.counts();
  EXPECT_FALSE(encoder.sample(std::numeric_limits<double>::quiet_NaN()));
  EXPECT_FALSE(encoder.sample(std::numeric_limits<double>::infinity()));
  EXPECT_FALSE(encoder.sample(1.0e9));
  EXPECT_EQ(encoder.counts(), before);
}

/// V(z) / X(z) as the header states it.
std::complex<double> stated(double frequency_Hz, double cutoff_Hz) {
  const double a = std::exp(-2.0 * kPi * cutoff_Hz * kT);
  const std::complex<double> z_1 = std::polar(1.0, -2.0 * kPi * frequency_Hz * kT);
  return (1.0 - a) / (1.0 - a * z_1) * (1.0 - z_1) / kT;
}

TEST(FilteredDifference, HasTheStatedFrequencyResponse) {
  for (const double cutoff : {0.0, 50.0, 150.0}) {
    for (const double f : {1.0, 10.0, 100.0, 400.0}) {
      FilteredDifference rate;
      rate.configure(cutoff, kT);
      std::complex<double> sum = 0.0;  // correlation over whole periods, after settling
      for (int k = 0; k < 3000; ++k) {
        const double phase = 2.0 * kPi * f * k * kT;
        const double v = rate.update(std::cos(phase));
        if (k >= 2000) sum += v * std::polar(2.0 / 1000.0, -phase);
      }
      const std::complex<double> wanted =
          cutoff > 0.0 ? stated(f, cutoff) : (1.0 - std::polar(1.0, -2.0 * kPi * f * kT)) / kT;
      EXPECT_NEAR(std::abs(sum - wanted) / std::abs(wanted), 0.0, 1.0e-9) << cutoff << " " << f;
    }
  }
}

TEST(FilteredDifference, IsExactOnARampAndLagsAnAccelerationAsStated) {
  const double cutoff = 150.0;
  const double a = std::exp(-2.0 * kPi * cutoff * kT);
  FilteredDifference ramp;
  FilteredDifference parabola;
  ramp.configure(cutoff, kT);
  parabola.configure(cutoff, kT);
  double t = 0.0;
  for (int k = 0; k < 500; ++k) {
    t = k * kT;
    ramp.update(3.0 * t);
    parabola.update(0.5 * 20.0 * t * t);
  }
  EXPECT_NEAR(ramp.rate(), 3.0, 1.0e-11);
  EXPECT_NEAR(parabola.rate(), 20.0 * (t - kT / 2.0 - a * kT / (1.0 - a)), 1.0e-9);
}

TEST(FilteredDifference, LeavesTheStatedNoiseOfTheQuantum) {
  const double cutoff = 150.0;
  const double a = std::exp(-2.0 * kPi * cutoff * kT);
  Encoder encoder(524288.0);
  FilteredDifference rate;
  rate.configure(cutoff, kT);
  NoiseGenerator wander(7);  // a walk over many counts makes the quantum's error white
  double angle = 0.0;
  FilteredDifference clean;
  clean.configure(cutoff, kT);
  double sum = 0.0;
  const int samples = 20000;
  for (int k = 0; k < samples; ++k) {
    angle += 1.0e-4 * wander.normal();
    ASSERT_TRUE(encoder.sample(angle));
    const double error = rate.update(encoder.position_rad()) - clean.update(angle);
    sum += error * error;
  }
  const double stated =
      (1.0 - a) * std::sqrt(2.0 / (1.0 + a)) * encoder.rad_per_count() / (std::sqrt(12.0) * kT);
  EXPECT_NEAR(std::sqrt(sum / samples) / stated, 1.0, 0.03);
}

TEST(FilteredDifference, StartsAtRestWhereverItStarts) {
  FilteredDifference rate;
  rate.configure(150.0, kT);
  EXPECT_DOUBLE_EQ(rate.update(123.0), 0.0);
  EXPECT_GT(rate.update(123.1), 0.0);
}

TEST(NoiseGenerator, IsNormalEnoughAndRepeatsBySeed) {
  NoiseGenerator one(42);
  NoiseGenerator same(42);
  NoiseGenerator other(43);
  double sum = 0.0;
  double squares = 0.0;
  int beyond_2 = 0;
  int equal = 0;
  const int count = 100000;
  for (int k = 0; k < count; ++k) {
    const double x = one.normal();
    ASSERT_EQ(x, same.normal());
    equal += x == other.normal() ? 1 : 0;
    sum += x;
    squares += x * x;
    beyond_2 += std::abs(x) > 2.0 ? 1 : 0;
  }
  EXPECT_NEAR(sum / count, 0.0, 0.02);
  EXPECT_NEAR(squares / count, 1.0, 0.02);
  EXPECT_NEAR(beyond_2, 0.0455 * count, 0.004 * count);
  EXPECT_LT(equal, 10);
}

TEST(NoisySensor, RoundsToItsQuantumAndAddsItsBias) {
  NoisySensor sensor({.quantum = 0.5, .bias = 1.0}, 1);
  EXPECT_DOUBLE_EQ(sensor.sample(0.7), 1.5);
  EXPECT_DOUBLE_EQ(sensor.sample(-2.0), -1.0);
}

TEST(NoisySensor, IsTheTruthWithoutNoiseAndQuantum) {
  NoisySensor sensor({}, 1);
  EXPECT_EQ(sensor.sample(0.123456789), 0.123456789);
}

}  // namespace
}  // namespace tandem::firmware
