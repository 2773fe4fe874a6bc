// A seeded generator of near-normal noise, owned and archived by the board that measures.
// Layer: firmware_emu.  Thread: RT only.
#pragma once

#include <cstdint>

#include "base/realtime.hpp"

namespace tandem::firmware {

/// SplitMix64 (Steele, Lea, Flood 2014) and the sum of twelve uniform numbers (Irwin-Hall):
/// mean 0, variance 1, never beyond +-6, the same bits on every machine.
class NoiseGenerator {
 public:
  NoiseGenerator() = default;
  explicit NoiseGenerator(std::uint64_t seed) noexcept : state_(seed) {}

  /// A seed for stream `number` of those that hang on `seed`: neighbours share no numbers.
  [[nodiscard]] static std::uint64_t stream(std::uint64_t seed, std::uint64_t number) noexcept {
    NoiseGenerator mixer(seed);
    return mixer.next() ^ NoiseGenerator(number).next();
  }

  [[nodiscard]] double normal() noexcept TANDEM_RT {
    constexpr double kUnit = 1.0 / 65536.0;
    std::int64_t sum = 0;
    for (int draw = 0; draw < 3; ++draw) {
      const std::uint64_t bits = next();
      for (int lane = 0; lane < 64; lane += 16) {
        sum += static_cast<std::int64_t>((bits >> lane) & 0xFFFFU);
      }
    }
    return (static_cast<double>(sum) + 6.0) * kUnit - 6.0;  // + 12 half steps: mean exactly 0
  }

 private:
  std::uint64_t next() noexcept {
    state_ += 0x9E3779B97F4A7C15U;
    std::uint64_t z = state_;
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9U;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBU;
    return z ^ (z >> 31);
  }

  std::uint64_t state_ = 0;
};

}  // namespace tandem::firmware
