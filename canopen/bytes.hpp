// Little-endian numbers in a frame's bytes, whatever the host's byte order.
// Layer: canopen.  Thread: any.
#pragma once

#include <bit>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <type_traits>

#include "base/realtime.hpp"

namespace tandem::canopen {

namespace detail {
template <std::size_t Size>
struct UnsignedOf;
template <>
struct UnsignedOf<1> {
  using Type = std::uint8_t;
};
template <>
struct UnsignedOf<2> {
  using Type = std::uint16_t;
};
template <>
struct UnsignedOf<4> {
  using Type = std::uint32_t;
};
template <>
struct UnsignedOf<8> {
  using Type = std::uint64_t;
};
}  // namespace detail

/// Writes `value` (integer, REAL32, REAL64) to sizeof(T) bytes from `out`, lowest byte first.
template <class T>
requires std::is_arithmetic_v<T>
constexpr void put(std::uint8_t* out, T value) noexcept TANDEM_RT {
  using Bits = typename detail::UnsignedOf<sizeof(T)>::Type;
  const auto bits = std::bit_cast<Bits>(value);
  if (!std::is_constant_evaluated() && std::endian::native == std::endian::little) {
    std::memcpy(out, &bits, sizeof bits);  // one store: what reads it next need not wait
    return;
  }
  for (std::size_t i = 0; i < sizeof(T); ++i) out[i] = static_cast<std::uint8_t>(bits >> (8 * i));
}

/// Reads a T from sizeof(T) bytes from `in`, lowest byte first.
template <class T>
requires std::is_arithmetic_v<T>
[[nodiscard]] constexpr T get(const std::uint8_t* in) noexcept TANDEM_RT {
  using Bits = typename detail::UnsignedOf<sizeof(T)>::Type;
  Bits bits = 0;
  if (!std::is_constant_evaluated() && std::endian::native == std::endian::little) {
    std::memcpy(&bits, in, sizeof bits);
    return std::bit_cast<T>(bits);
  }
  for (std::size_t i = 0; i < sizeof(T); ++i) {
    bits = static_cast<Bits>(bits | static_cast<Bits>(static_cast<Bits>(in[i]) << (8 * i)));
  }
  return std::bit_cast<T>(bits);
}

/// The integer nearest to `value` (halves away from zero), clamped to T's range and never wrapped.
/// NaN gives 0.
template <std::integral T>
[[nodiscard]] constexpr T clamp_round(double value) noexcept TANDEM_RT {
  static_assert(sizeof(T) <= 4, "a double holds every value of T exactly");
  constexpr double kMin = std::numeric_limits<T>::min();
  constexpr double kMax = std::numeric_limits<T>::max();
  if (!(value == value)) return 0;
  if (value <= kMin) return std::numeric_limits<T>::min();
  if (value >= kMax) return std::numeric_limits<T>::max();
  const double rounded = value < 0.0 ? value - 0.5 : value + 0.5;
  return static_cast<T>(static_cast<std::int64_t>(rounded));
}

}  // namespace tandem::canopen
