// How many bits a frame takes on the wire, stuff bits and intermission included, and how long.
// Layer: hal/ethercat-can.  Thread: any; pure.
#pragma once

#include <cstddef>
#include <cstdint>

#include "base/realtime.hpp"
#include "canopen/frame.hpp"

namespace tandem::hal::can {

inline constexpr std::int64_t kSecondNs = 1'000'000'000;

/// Bit rates of one bus [bit/s].
struct BitRates {
  std::int64_t nominal = 1'000'000;  ///< arbitration; the whole of a classic frame
  std::int64_t data = 8'000'000;     ///< from ESI to the CRC of a frame with bit-rate switch
};

/// A frame as the wire counts it. The bits in which the rate changes (BRS and the CRC delimiter)
/// belong to both phases; they are counted as nominal, so a time is never too short.
struct FrameBits {
  int nominal = 0;
  int data = 0;

  FrameBits& operator+=(const FrameBits& other) noexcept {
    nominal += other.nominal;
    data += other.data;
    return *this;
  }
  bool operator==(const FrameBits&) const = default;
};

/// [ns], rounded up.
[[nodiscard]] constexpr std::int64_t duration_ns(const FrameBits& bits,
                                                 const BitRates& rates) noexcept {
  const auto up = [](std::int64_t count, std::int64_t rate) {
    return (count * kSecondNs + rate - 1) / rate;
  };
  return up(bits.nominal, rates.nominal) + up(bits.data, rates.data);
}

namespace wire {  // ISO 11898-1:2015, base format (11-bit identifier)
/// SOF, identifier, RTR, IDE, FDF (r0), DLC; then 8 a byte, and the CRC: all of it is stuffed.
inline constexpr int kClassicHead = 1 + 11 + 1 + 1 + 1 + 4;
inline constexpr int kClassicCrc = 15;
/// SOF, identifier, RRS, IDE, FDF, res, BRS.
inline constexpr int kFdArbitration = 1 + 11 + 1 + 1 + 1 + 1 + 1;
/// ESI, DLC.
inline constexpr int kFdDataHead = 1 + 4;
/// CRC delimiter, ACK, ACK delimiter, EOF, intermission: never stuffed.
inline constexpr int kTail = 1 + 1 + 1 + 7 + 3;
inline constexpr int kMostCrc17Bytes = 16;

/// Stuff count (4 bits) and CRC 17 or 21, with a fixed stuff bit in front of every 4 bits.
[[nodiscard]] constexpr int fd_crc_field(int bytes) noexcept {
  const int bits = 4 + (bytes <= kMostCrc17Bytes ? 17 : 21);
  return bits + (bits + 3) / 4;
}
}  // namespace wire

/// The longest that any content makes a frame of `bytes` bytes: a stuff bit after the first five
/// bits, and after every four that follow.
/// @param switched  FD only: with bit-rate switch
[[nodiscard]] constexpr FrameBits worst_frame_bits(int bytes, bool fd,
                                                   bool switched = true) noexcept {
  const auto stuffed = [](int bits) { return bits + (bits - 1) / 4; };
  if (!fd) {
    const int bits = wire::kClassicHead + 8 * bytes + wire::kClassicCrc;
    return {.nominal = stuffed(bits) + wire::kTail, .data = 0};
  }
  const int arbitration = stuffed(wire::kFdArbitration);
  const int rest = stuffed(wire::kFdArbitration + wire::kFdDataHead + 8 * bytes) - arbitration +
                   wire::fd_crc_field(bytes);
  return switched ? FrameBits{.nominal = arbitration + wire::kTail, .data = rest}
                  : FrameBits{.nominal = arbitration + rest + wire::kTail, .data = 0};
}

/// This very frame: its bits are laid out, its CRC computed (a classic frame's is stuffed; the
/// field of an FD frame has a fixed length), its stuff bits counted.
/// @pre a data frame that CAN or CAN FD can carry
/// @rt no allocation; O(bits)
[[nodiscard]] FrameBits exact_frame_bits(const canopen::Frame& frame) noexcept TANDEM_RT;

}  // namespace tandem::hal::can
