// MCAP's framing (mcap.dev/spec): record opcodes and the file's magic.
// Layer: log.  Thread: any.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace tandem::log {

/// A record is: opcode u8, content length u64, content. Integers are little-endian, a string is
/// its u32 length and characters, a map or array is its u32 length in bytes and elements.
enum class Opcode : std::uint8_t {
  kHeader = 0x01,           ///< profile, library
  kFooter = 0x02,           ///< summary start u64, summary offset start u64, summary CRC u32
  kSchema = 0x03,           ///< id u16, name, encoding, data (u32 length)
  kChannel = 0x04,          ///< id u16, schema id u16, topic, message encoding, metadata map
  kMessage = 0x05,          ///< channel u16, sequence u32, log time u64, publish time u64, data
  kChunk = 0x06,            ///< start u64, end u64, size u64, CRC u32, compression, records (u64)
  kMessageIndex = 0x07,     ///< channel u16, array of {time u64, offset in the chunk u64}
  kChunkIndex = 0x08,       ///< where a chunk and its message indices are
  kAttachment = 0x09,       ///< times u64 x2, name, media type, data (u64 length), CRC u32
  kAttachmentIndex = 0x0A,  ///< where an attachment is, and what it says
  kStatistics = 0x0B,       ///< counts
  kMetadata = 0x0C,         ///< name, map of strings
  kMetadataIndex = 0x0D,    ///< offset u64, length u64, name
  kSummaryOffset = 0x0E,    ///< group opcode u8, start u64, length u64
  kDataEnd = 0x0F,          ///< CRC u32 of everything before
};

inline constexpr std::array<std::byte, 8> kMagic{std::byte{0x89}, std::byte{'M'}, std::byte{'C'},
                                                 std::byte{'A'},  std::byte{'P'}, std::byte{'0'},
                                                 std::byte{'\r'}, std::byte{'\n'}};
inline constexpr std::size_t kRecordHeaderBytes = 9;
inline constexpr std::size_t kMessageHeaderBytes = 22;

/// Media type of what is attached.
inline constexpr std::string_view kAttachedType = "application/octet-stream";

/// A metadata map in its written order.
using StringMap = std::vector<std::pair<std::string, std::string>>;

}  // namespace tandem::log
