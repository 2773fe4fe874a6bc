// A place of a log's file that cannot be read: it is left out, and said.
// Layer: log.  Thread: any, non-RT.
#pragma once

#include <cstdint>
#include <string>

namespace tandem::log {

/// What of a file is damaged. Reading goes on behind it.
struct Damage {
  std::uint64_t at = 0;  ///< in the file; 0: the file as a whole
  std::uint64_t bytes = 0;
  bool chunk = false;                      ///< a chunk of messages; else another record
  std::int64_t first_ns = 0, last_ns = 0;  ///< of a chunk: its messages' times
  bool loses_messages = true;              ///< false: all messages are here
  std::string what{};                      ///< "its checksum is wrong; its messages are left out"
};

/// "chunk of 1047 bytes at byte 4096, 12.000 to 12.200 s: its checksum is wrong; its messages are
/// left out"
[[nodiscard]] std::string to_string(const Damage& damage);

}  // namespace tandem::log
