// The generator behind everything random in a simulated run: the same numbers on every machine.
// Layer: base.  Thread: any.
#pragma once

#include <cstdint>

#include "base/realtime.hpp"

namespace tandem {

/// SplitMix64 (Steele, Lea, Flood 2014).
/// @param state  in: the seed, or what the last call left; out: for the next one
/// @return 64 bits, each as often 1 as 0
[[nodiscard]] inline std::uint64_t split_mix(std::uint64_t& state) noexcept TANDEM_RT {
  std::uint64_t z = (state += 0x9E3779B97F4A7C15U);
  z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9U;
  z = (z ^ (z >> 27)) * 0x94D049BB133111EBU;
  return z ^ (z >> 31);
}

}  // namespace tandem
