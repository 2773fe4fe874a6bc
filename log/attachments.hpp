// Files within a log: Recorder::attach(). Found without reading the messages between them.
// Layer: log.  Thread: any, non-RT.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.hpp"
#include "log/bytes.hpp"

namespace tandem::log {

/// What a run attaches: its state before cycle N; and, without bytes, that cycle N was given
/// something from outside and cannot be played again. N follows the name.
inline constexpr std::string_view kStateName = "state-", kHeardName = "heard-";

/// Where one stands.
struct Attachment {
  std::string name;
  std::string file;                 ///< of the log's files
  std::int64_t time_ns = 0;         ///< log time
  std::uint64_t at = 0, bytes = 0;  ///< of its record, without the head
};

/// Those of one file, in its order; of one that was cut, up to there. What is damaged is left out.
/// Errors: open_to_read()'s; no MCAP.
[[nodiscard]] Result<std::vector<Attachment>> attachments_of(const std::string& path);
/// Errors: the file is another one by now; its checksum is wrong.
[[nodiscard]] Result<Bytes> read_attachment(const Attachment& one);

}  // namespace tandem::log
