// Writes an MCAP file: chunked, indexed, checksummed, readable up to the last whole chunk when
// the process is killed.
// Layer: log.  Thread: one at a time, non-RT.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/open_file.hpp"
#include "base/result.hpp"
#include "log/bytes.hpp"
#include "log/compression.hpp"
#include "log/disk_limits.hpp"
#include "log/mcap_format.hpp"

namespace tandem::log {

struct WriterOptions {
  Compression compression = Compression::kNone;
  std::size_t chunk_bytes = 1024 * 1024;     ///< a chunk is closed once it holds as much,
  std::int64_t chunk_span_ns = 200'000'000;  ///< or as much log time: what a killed run loses
};

/// The file's content depends on the calls alone: no date, no clock, no random id.
class McapWriter {
 public:
  McapWriter() = default;
  McapWriter(const McapWriter&) = delete;
  McapWriter& operator=(const McapWriter&) = delete;

  /// Creates (or overwrites) `path` and writes the header, profile "ros2".
  /// Errors: open_output()'s, a full disk: with what to do.
  [[nodiscard]] Status open(const std::string& path, const WriterOptions& options);
  /// The same to a file that is open. @param path  for errors
  [[nodiscard]] Status open(Descriptor file, const std::string& path, const WriterOptions& options);

  /// Ids count from 1 (schemas) and 0 (channels). Written into the first chunk.
  std::uint16_t add_schema(std::string_view name, std::string_view encoding, std::string_view text);
  std::uint16_t add_channel(std::uint16_t schema, std::string_view topic,
                            std::string_view message_encoding, const StringMap& metadata = {});
  /// How many there are: the next one's id.
  [[nodiscard]] std::uint16_t channels() const noexcept {
    return static_cast<std::uint16_t>(channels_.size());
  }
  /// Outside of every chunk, at the present end of the file.
  void add_metadata(std::string_view name, const StringMap& map);
  /// The same: a file within the file, which other programs pass over. @param time_ns  log time
  void add_attachment(std::string_view name, std::int64_t time_ns, std::span<const std::byte> data);

  /// Appends a message of `head` then `body`. False once writing has failed.
  bool write(std::uint16_t channel, std::int64_t time_ns, std::span<const std::byte> head,
             std::span<const std::byte> body);

  /// Closes the open chunk, writes the summary and the footer. Errors: the first failed write.
  [[nodiscard]] Status close();

  [[nodiscard]] bool is_open() const noexcept { return file_.get() >= 0; }
  /// The disk that the file is on. Nothing: it does not say.
  [[nodiscard]] std::optional<DiskRoom> room() const;
  [[nodiscard]] bool failed() const noexcept { return !error_.empty(); }
  /// "No space left on device", or empty.
  [[nodiscard]] const std::string& error() const noexcept { return error_; }
  /// Number of messages() that are not in the file: all of them when it was deleted.
  [[nodiscard]] std::uint64_t lost() const noexcept;
  [[nodiscard]] std::uint64_t bytes_written() const noexcept { return offset_; }
  [[nodiscard]] std::uint64_t messages() const noexcept { return statistics_.messages; }

 private:
  struct IndexEntry {
    std::uint64_t time;
    std::uint64_t offset;
  };
  struct Chunk {  // what the summary says of a finished one
    std::uint64_t start_time = 0, end_time = 0, offset = 0, length = 0;
    std::map<std::uint16_t, std::uint64_t> index_offsets;
    std::uint64_t index_length = 0, compressed = 0, uncompressed = 0, messages = 0;
  };
  struct MetadataPlace {
    std::uint64_t offset, length;
    std::string name;
  };
  struct AttachmentPlace {
    std::uint64_t offset, length, time, size;
    std::string name;
  };
  struct Statistics {
    std::uint64_t messages = 0, start_time = 0, end_time = 0;
    std::map<std::uint16_t, std::uint64_t> per_channel;
  };

  void look_at_file();  // fails when it was deleted or cut meanwhile
  void fail(std::string error, std::uint64_t kept_bytes);
  void emit(std::span<const std::byte> bytes);  // to the file, into the CRC
  void put(std::span<const std::byte> bytes);   // to the file, whose CRC has them already
  void emit_record(Opcode opcode, const Bytes& content);
  void finish_chunk();
  void write_indices(Chunk& chunk);
  void write_summary();
  void summary_group(Opcode opcode, std::uint64_t start, Bytes& offsets) const;
  [[nodiscard]] Bytes statistics_content() const;
  [[nodiscard]] Bytes chunk_index_content(const Chunk& chunk) const;

  Descriptor file_;
  std::string path_, error_;
  WriterOptions options_;
  std::uint64_t offset_ = 0;
  std::uint64_t kept_bytes_ = 0;  // of a file that failed
  std::uint32_t crc_ = 0;

  Bytes chunk_;       // records of the open chunk
  Bytes compressed_;  // reused
  std::uint64_t chunk_start_ = 0, chunk_end_ = 0;
  bool chunk_has_messages_ = false;
  std::uint64_t chunked_messages_ = 0;          // in finished chunks
  std::vector<std::vector<IndexEntry>> index_;  // by channel, of the open chunk
  std::vector<std::uint32_t> sequence_;         // by channel

  std::vector<Bytes> schemas_, channels_;  // contents, for the summary
  std::vector<Chunk> chunks_;
  std::vector<MetadataPlace> metadata_;
  std::vector<AttachmentPlace> attachments_;
  Statistics statistics_;
};

}  // namespace tandem::log
