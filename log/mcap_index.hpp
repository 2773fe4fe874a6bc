// The summary at the end of an MCAP file that was closed: where its records stand, by which a
// reader passes over a damaged one.
// Layer: log.  Thread: one at a time, non-RT.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "base/open_file.hpp"
#include "log/bytes.hpp"
#include "log/mcap_format.hpp"

namespace tandem::log {

/// Fills `into` with what stands at `at`. False: the file is shorter, or its disk does not answer.
[[nodiscard]] bool read_at(const Descriptor& file, std::uint64_t at, std::span<std::byte> into);

/// A record of the data: a chunk, metadata, an attachment.
struct RecordPlace {
  Opcode opcode{};
  std::uint64_t at = 0;
  std::uint64_t bytes = 0;                 ///< with its head
  std::uint64_t end = 0;                   ///< behind it, and behind the message indices of a chunk
  std::int64_t first_ns = 0, last_ns = 0;  ///< of a chunk's messages
};

struct McapIndex {
  std::vector<RecordPlace> places{};              ///< in the file's order, none in another
  std::vector<std::pair<Opcode, Bytes>> texts{};  ///< all schemas, all channels
  std::uint64_t data_end = 0;  ///< the data are before it; 0: there is no summary to rely on
  bool damaged = false;        ///< there is one, and it cannot be relied on
};

/// Only a summary whose checksum is right is taken: a file without loses nothing but the help.
[[nodiscard]] McapIndex read_index(const Descriptor& file, std::uint64_t file_bytes);

/// The map of a metadata record. None: it is shorter than its content.
[[nodiscard]] std::optional<StringMap> read_map(ByteReader& in);

}  // namespace tandem::log
