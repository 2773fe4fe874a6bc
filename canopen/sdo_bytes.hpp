// What both ends of a service data object's transfer have in common on the wire.
// Layer: canopen.  Thread: any.
#pragma once

#include <cstddef>
#include <cstdint>

#include "canopen/bytes.hpp"
#include "canopen/frame.hpp"

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
inline constexpr std::size_t kExpeditedBytes = 4;

/// A frame without data yet.
/// @param cob  cob::kSdoRequest or kSdoResponse of the server's node
[[nodiscard]] inline Frame sdo_frame(std::uint32_t cob, int node, std::uint8_t command) noexcept {
  Frame frame;
  frame.id = cob + static_cast<std::uint32_t>(node);
  frame.length = kClassicFrameBytes;
  frame.data[0] = command;
  return frame;
}

/// One that names its object.
[[nodiscard]] inline Frame sdo_frame(std::uint32_t cob, int node, std::uint8_t command,
                                     std::uint16_t index, std::uint8_t sub) noexcept {
  Frame frame = sdo_frame(cob, node, command);
  put(&frame.data[1], index);
  frame.data[3] = sub;
  return frame;
}

}  // namespace tandem::canopen
