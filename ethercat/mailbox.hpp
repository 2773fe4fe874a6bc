// Messages in a slave's mailbox: their header, CANopen over EtherCAT (CoE) and its SDOs.
// Layer: ethercat.  Thread: any.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "base/realtime.hpp"
#include "canopen/abort_code.hpp"
#include "canopen/bytes.hpp"

// A message: length of what follows the header (2), station (2), channel and priority (1),
//   type in bits 0-3 and counter 1-7 in bits 4-6 (1)
// CoE: number in bits 0-8 and service in bits 12-15 (2)
// SDO, as in CiA 301:  command, index (2), sub (1), data or size (4) [, data]
//   segment:  command: bits 7-5 specifier, 4 toggle, 3-1 unused bytes of seven, 0 last; data

namespace tandem::ethercat {

inline constexpr std::size_t kMailboxHeaderBytes = 6;
inline constexpr std::size_t kCoeHeaderBytes = 2;
inline constexpr std::size_t kSdoHeaderBytes = 8;
/// Where an SDO's command is.
inline constexpr std::size_t kSdoAt = kMailboxHeaderBytes + kCoeHeaderBytes;
/// Where the data of a normal transfer's first message begins.
inline constexpr std::size_t kSdoDataAt = kSdoAt + kSdoHeaderBytes;
/// Where a segment's data begins.
inline constexpr std::size_t kSegmentDataAt = kSdoAt + 1;
/// A segment has room for so much at least.
inline constexpr std::size_t kShortSegment = 7;
/// The smallest mailbox that can carry every SDO message.
inline constexpr std::size_t kMinMailboxBytes = kSdoDataAt + kShortSegment;
/// The largest: what one datagram can carry.
inline constexpr std::size_t kMaxMailboxBytes = 1486;

enum class MailboxType : std::uint8_t {
  kError = 0,
  kCoe = 3,
};

/// Why a slave did not take a message (type kError).
enum class MailboxError : std::uint16_t {
  kNone = 0,
  kSyntax = 1,
  kProtocol = 2,  ///< of this type there is none here
  kChannel = 3,
  kService = 4,
  kHeader = 5,
  kTooShort = 6,
  kNoMemory = 7,
  kSize = 8,
};

enum class CoeService : std::uint8_t {
  kEmergency = 1,
  kSdoRequest = 2,
  kSdoResponse = 3,
  kInformation = 8,
};

/// A message's header.
struct MailboxHeader {
  std::uint16_t length = 0;
  MailboxType type = MailboxType::kError;
  std::uint8_t counter = 0;  ///< 1 to 7; 0: the sender does not count
};

/// Reads a header.
/// @return false when `bytes` has no room for the header and `length` bytes behind it
[[nodiscard]] inline bool read_mailbox(std::span<const std::uint8_t> bytes,
                                       MailboxHeader& header) noexcept TANDEM_RT {
  if (bytes.size() < kMailboxHeaderBytes) return false;
  header.length = canopen::get<std::uint16_t>(bytes.data());
  header.type = static_cast<MailboxType>(bytes[5] & 0x0F);
  header.counter = (bytes[5] >> 4) & 0x07;
  return header.length <= bytes.size() - kMailboxHeaderBytes;
}

/// Writes a header. @pre out has kMailboxHeaderBytes
inline void write_mailbox(std::uint8_t* out, const MailboxHeader& header) noexcept TANDEM_RT {
  canopen::put(out, header.length);
  out[2] = out[3] = out[4] = 0;
  out[5] = static_cast<std::uint8_t>(static_cast<unsigned>(header.type) | (header.counter << 4));
}

/// Writes mailbox and CoE header of a message of `bytes` in all.
inline void write_coe(std::span<std::uint8_t> out, std::size_t bytes, CoeService service,
                      std::uint8_t counter) noexcept TANDEM_RT {
  write_mailbox(out.data(), {.length = static_cast<std::uint16_t>(bytes - kMailboxHeaderBytes),
                             .type = MailboxType::kCoe,
                             .counter = counter});
  canopen::put(&out[kMailboxHeaderBytes],
               static_cast<std::uint16_t>(static_cast<unsigned>(service) << 12));
}

/// The service of a CoE message. @pre bytes.size() >= kSdoAt
[[nodiscard]] inline CoeService coe_service(std::span<const std::uint8_t> bytes) noexcept {
  return static_cast<CoeService>(bytes[kMailboxHeaderBytes + 1] >> 4);
}

/// The counter after `counter`: 1 to 7, around.
[[nodiscard]] constexpr std::uint8_t next_counter(std::uint8_t counter) noexcept {
  return static_cast<std::uint8_t>(counter % 7 + 1);
}

/// Writes command, index and sub-index of an SDO; the four bytes after them are zero.
inline void write_sdo(std::span<std::uint8_t> out, std::uint8_t command, std::uint16_t index,
                      std::uint8_t sub) noexcept TANDEM_RT {
  out[kSdoAt] = command;
  canopen::put(&out[kSdoAt + 1], index);
  out[kSdoAt + 3] = sub;
  canopen::put(&out[kSdoAt + 4], std::uint32_t{0});
}

/// SDO commands of the first message of a transfer, and of an abort.
namespace sdo {
inline constexpr std::uint8_t kDownloadRequest = 0x20;
inline constexpr std::uint8_t kDownloadResponse = 0x60;
inline constexpr std::uint8_t kUploadRequest = 0x40;
inline constexpr std::uint8_t kUploadResponse = 0x40;
inline constexpr std::uint8_t kDownloadSegment = 0x00;
inline constexpr std::uint8_t kDownloadSegmentResponse = 0x20;
inline constexpr std::uint8_t kUploadSegment = 0x60;
inline constexpr std::uint8_t kUploadSegmentResponse = 0x00;
inline constexpr std::uint8_t kAbort = 0x80;
inline constexpr std::uint8_t kSpecifier = 0xE0;  ///< mask of the bits that tell them apart
inline constexpr std::uint8_t kComplete = 0x10;   ///< all sub-indices at once
inline constexpr std::uint8_t kExpedited = 0x02;
inline constexpr std::uint8_t kSizeGiven = 0x01;
inline constexpr std::uint8_t kToggle = 0x10;
inline constexpr std::uint8_t kLast = 0x01;
inline constexpr std::size_t kExpeditedBytes = 4;

/// Bits of an expedited transfer's command for 1 to 4 bytes.
[[nodiscard]] constexpr std::uint8_t expedited(std::size_t bytes) noexcept {
  return static_cast<std::uint8_t>(kExpedited | kSizeGiven | ((4 - bytes) << 2));
}
/// How many bytes an expedited command carries; 4 when it does not say.
[[nodiscard]] constexpr std::size_t expedited_bytes(std::uint8_t command) noexcept {
  return (command & kSizeGiven) != 0 ? 4u - ((command >> 2) & 3u) : 4u;
}
/// Bits of a segment's command for its length.
[[nodiscard]] constexpr std::uint8_t segment(std::size_t bytes, bool toggle, bool last) noexcept {
  const std::size_t unused = bytes < kShortSegment ? kShortSegment - bytes : 0;
  return static_cast<std::uint8_t>((toggle ? kToggle : 0) | (unused << 1) | (last ? kLast : 0));
}
/// How many of a segment message's `room` bytes are data.
[[nodiscard]] constexpr std::size_t segment_bytes(std::uint8_t command, std::size_t room) noexcept {
  if (room > kShortSegment) return room;
  const std::size_t used = kShortSegment - ((command >> 1) & 7u);
  return used < room ? used : room;
}
}  // namespace sdo

}  // namespace tandem::ethercat
