// From the truth to what a board knows: counts, a velocity made of counts, a torque sample.
// Layer: firmware_emu.  Thread: RT only.
#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>

#include "base/decay.hpp"
#include "base/realtime.hpp"
#include "base/split_mix.hpp"

namespace tandem::firmware {

/// The sum of twelve uniform numbers (Irwin-Hall): mean 0, variance 1, never beyond +-6, the same
/// bits on every machine.
class NoiseGenerator {
 public:
  NoiseGenerator() = default;
  explicit NoiseGenerator(std::uint64_t seed) noexcept : state_(seed) {}

  /// A seed for stream `number` of those that hang on `seed`: neighbours share no numbers.
  [[nodiscard]] static std::uint64_t stream(std::uint64_t seed, std::uint64_t number) noexcept {
    return split_mix(seed) ^ split_mix(number);
  }

  [[nodiscard]] double normal() noexcept TANDEM_RT {
    constexpr double kUnit = 1.0 / 65536.0;
    std::int64_t sum = 0;
    for (int draw = 0; draw < 3; ++draw) {
      const std::uint64_t bits = split_mix(state_);
      for (int lane = 0; lane < 64; lane += 16) {
        sum += static_cast<std::int64_t>((bits >> lane) & 0xFFFFU);
      }
    }
    return (static_cast<double>(sum) + 6.0) * kUnit - 6.0;  // + 12 half steps: mean exactly 0
  }

 private:
  std::uint64_t state_ = 0;
};

/// The integer nearest to `value`, halves away from zero. @pre |value| < 2^62
[[nodiscard]] inline std::int64_t nearest_integer(double value) noexcept {
  return static_cast<std::int64_t>(value + (value < 0.0 ? -0.5 : 0.5));
}

/// An encoder of `counts_per_rev` counts per revolution of the link.
class Encoder {
 public:
  Encoder() = default;
  explicit Encoder(double counts_per_rev) noexcept { set_resolution(counts_per_rev); }

  void set_resolution(double counts_per_rev) noexcept TANDEM_RT {
    counts_per_rad_ = counts_per_rev / (2.0 * std::numbers::pi);
    rad_per_count_ = 2.0 * std::numbers::pi / counts_per_rev;
  }
  /// The count shown at this angle. An angle that is no number, or beyond 2^31 counts, leaves
  /// the last count and returns false.
  [[nodiscard]] bool sample(double angle_rad) noexcept TANDEM_RT {
    const double counts = angle_rad * counts_per_rad_;
    if (!(std::abs(counts) < 2147483647.0)) return false;  // also refuses NaN
    counts_ = nearest_integer(counts);
    return true;
  }
  [[nodiscard]] std::int64_t counts() const noexcept { return counts_; }
  [[nodiscard]] double position_rad() const noexcept {
    return static_cast<double>(counts_) * rad_per_count_;
  }
  [[nodiscard]] double rad_per_count() const noexcept { return rad_per_count_; }
  [[nodiscard]] double counts_per_rad() const noexcept { return counts_per_rad_; }

 private:
  double counts_per_rad_ = 1.0;
  double rad_per_count_ = 1.0;
  std::int64_t counts_ = 0;
};

/// The derivative of a sampled signal: a difference through a first-order low-pass.
///
///   V(z) / X(z) = (1 - a) / (1 - a z^-1) * (1 - z^-1) / T,  a = exp(-2 pi f T)
///
/// Exact on a ramp; behind a steady acceleration A by A (T / 2 + a T / (1 - a)). A quantum Q,
/// as white noise of Q^2 / 12, leaves a deviation of (1 - a) sqrt(2 / (1 + a)) Q / (sqrt(12) T).
class FilteredDifference {
 public:
  /// @param cutoff_Hz  f; 0: the plain difference. @param period_s  T > 0.
  void configure(double cutoff_Hz, double period_s) noexcept TANDEM_RT {
    decay_ = cutoff_Hz > 0.0 ? decay(2.0 * std::numbers::pi * cutoff_Hz * period_s) : 0.0;
    gain_ = (1.0 - decay_) / period_s;
  }
  /// One sample, T after the one before; the first one only starts the estimate at 0.
  double update(double value) noexcept TANDEM_RT {
    if (!started_) {
      previous_ = value;
      started_ = 1;
    }
    rate_ = decay_ * rate_ + gain_ * (value - previous_);
    previous_ = value;
    return rate_;
  }
  [[nodiscard]] double rate() const noexcept { return rate_; }
  void restart() noexcept TANDEM_RT {
    rate_ = 0.0;
    started_ = 0;
  }

 private:
  double decay_ = 0.0;
  double gain_ = 0.0;
  double previous_ = 0.0;
  double rate_ = 0.0;
  std::int64_t started_ = 0;
};

/// A sensor that adds noise, then rounds to its quantum.
class NoisySensor {
 public:
  struct Config {
    double noise = 0.0;    ///< standard deviation
    double quantum = 0.0;  ///< 0: no rounding
    double bias = 0.0;
  };
  NoisySensor() = default;
  NoisySensor(const Config& config, std::uint64_t seed) noexcept
      : config_(config), generator_(seed) {}

  [[nodiscard]] double sample(double truth) noexcept TANDEM_RT {
    double value = truth + config_.bias;
    if (config_.noise > 0.0) value += config_.noise * generator_.normal();
    if (config_.quantum > 0.0) {
      const double steps = value / config_.quantum;
      if (std::abs(steps) < 9.0e15) {
        value = static_cast<double>(nearest_integer(steps)) * config_.quantum;
      }
    }
    return value;
  }

 private:
  Config config_;
  NoiseGenerator generator_;
};

}  // namespace tandem::firmware
