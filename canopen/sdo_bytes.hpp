// What both ends of a service data object's transfer have in common on the wire.
// Layer: canopen.  Thread: any.
#pragma once

#include <cstddef>
#include <cstdint>

// Layouts (CiA 301): byte 0 is the command, bits 7 to 5 the command specifier.
//   initiate:  command, index (2), sub (1), data or size (4)
//   segment:   command, up to 7 bytes of data; bit 4 toggle, bits 3-1 unused bytes, bit 0 last

namespace tandem::canopen {

inline constexpr std::uint8_t kAbort = 4;  ///< command specifier, of either end

inline constexpr std::uint8_t kExpedited = 0x02;
inline constexpr std::uint8_t kSizeGiven = 0x01;
inline constexpr std::uint8_t kToggleBit = 0x10;
inline constexpr std::uint8_t kLast = 0x01;
inline constexpr std::size_t kSegmentBytes = 7;

}  // namespace tandem::canopen
