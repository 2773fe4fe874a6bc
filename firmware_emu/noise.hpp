// A seeded generator of near-normal noise, owned and archived by the board that measures.
// Layer: firmware_emu.  Thread: RT only.
#pragma once

#include <cstdint>

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

}  // namespace tandem::firmware
