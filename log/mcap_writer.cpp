// A chunk is closed by log time or size, never by the wall clock, and written at once; summary and
// indices follow on close().
#include "log/mcap_writer.hpp"

#include <libdeflate.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <utility>

namespace tandem::log {
namespace {

constexpr std::uint64_t kSpaceNeeded = 1024 * 1024;  // less on the disk is a full disk

std::uint32_t crc(std::uint32_t before, std::span<const std::byte> bytes) {
  if (bytes.empty()) return before;  // libdeflate begins anew at a null pointer
  return libdeflate_crc32(before, bytes.data(), bytes.size());
}

/// Product of two polynomials modulo the CRC's: bit 31 is the coefficient of x^0.
std::uint32_t product(std::uint32_t a, std::uint32_t b) noexcept {
  constexpr std::uint32_t kModulus = 0xEDB88320;
  std::uint32_t sum = 0;
  for (std::uint32_t bit = 1U << 31; bit != 0; bit >>= 1) {
    if ((a & bit) != 0) sum ^= b;
    b = (b >> 1) ^ ((b & 1) != 0 ? kModulus : 0);
  }
  return sum;
}

/// The CRC of two pieces of which those are the CRCs: the first times x^(bits of the second).
std::uint32_t joined(std::uint32_t first, std::uint32_t second, std::size_t second_bytes) noexcept {
  std::uint32_t power = 1U << 23;  // x^8
  for (std::size_t left = second_bytes; left != 0; left >>= 1) {
    if ((left & 1) != 0) first = product(first, power);
    power = product(power, power);
  }
  return first ^ second;
}

void append_record(Bytes& out, Opcode opcode, std::span<const std::byte> content) {
  append(out, static_cast<std::uint8_t>(opcode));
  append(out, static_cast<std::uint64_t>(content.size()));
  append(out, content);
}

void append_map(Bytes& out, const StringMap& map) {
  Bytes pairs;
  for (const auto& [key, value] : map) {
    append(pairs, key);
    append(pairs, value);
  }
  append(out, static_cast<std::uint32_t>(pairs.size()));
  append(out, pairs);
}

void append_map(Bytes& out, const std::map<std::uint16_t, std::uint64_t>& map) {
  append(out, static_cast<std::uint32_t>(map.size() * 10));
  for (const auto& [key, value] : map) {
    append(out, key);
    append(out, value);
  }
}

Error open_error(const std::string& path, int error, const std::string& reason) {
  std::string hint;
  switch (error) {
    case ENOENT: hint = "create the folder first"; break;
    case EACCES:
    case EPERM:
    case EROFS: hint = "choose a folder that you may write to"; break;
    case ENOSPC: hint = "free some space or choose another folder"; break;
    default: hint = "choose another path"; break;
  }
  return {.message = "cannot write the log: " + reason, .hint = hint, .file = path, .key = {}};
}

}  // namespace

Status McapWriter::open(const std::string& path, const WriterOptions& options) {
  Result<Descriptor> file = open_output(path, 0644);
  if (!file) return std::unexpected(open_error(path, errno, file.error().message));
  return open(std::move(*file), path, options);
}

Status McapWriter::open(Descriptor file, const std::string& path, const WriterOptions& options) {
  path_ = path;
  options_ = options;
  file_ = std::move(file);
  (void)::flock(file_.get(), LOCK_EX | LOCK_NB);  // readers see by it that it is being written
  if (const auto disk = room(); disk && disk->free_bytes < kSpaceNeeded) {
    return std::unexpected(open_error(path, ENOSPC, std::strerror(ENOSPC)));
  }
  chunk_.reserve(options.chunk_bytes + options.chunk_bytes / 4);
  errno = 0;  // what fails from here on may be no system call
  emit(kMagic);
  Bytes header;
  append(header, "ros2");
  append(header, "tandem");
  emit_record(Opcode::kHeader, header);
  if (failed()) return std::unexpected(open_error(path, errno, error_));
  return {};
}

std::optional<DiskRoom> McapWriter::room() const { return disk_room(file_); }

void McapWriter::look_at_file() {
  struct stat found {};
  if (failed() || ::fstat(file_.get(), &found) != 0 || !S_ISREG(found.st_mode)) return;
  const auto size = static_cast<std::uint64_t>(found.st_size);
  if (found.st_nlink == 0) {
    fail("its file was deleted during the run", 0);
  } else if (size < offset_) {
    fail("its file was cut to " + std::to_string(size) + " bytes during the run", size);
  }
}

void McapWriter::fail(std::string error, std::uint64_t kept_bytes) {
  error_ = std::move(error);
  kept_bytes_ = kept_bytes;
}

std::uint64_t McapWriter::lost() const noexcept {
  if (!failed()) return 0;
  std::uint64_t kept = 0;
  for (const Chunk& chunk : chunks_) {
    if (chunk.offset + chunk.length <= kept_bytes_) kept += chunk.messages;
  }
  return statistics_.messages - kept;
}

void McapWriter::emit(std::span<const std::byte> bytes) {
  crc_ = crc(crc_, bytes);
  put(bytes);
}

void McapWriter::put(std::span<const std::byte> bytes) {
  look_at_file();
  while (!bytes.empty() && !failed()) {
    const ssize_t written = ::write(file_.get(), bytes.data(), bytes.size());
    if (written < 0) {
      if (errno != EINTR) fail(std::strerror(errno), offset_);
      continue;
    }
    bytes = bytes.subspan(static_cast<std::size_t>(written));
    offset_ += static_cast<std::uint64_t>(written);
  }
}

void McapWriter::emit_record(Opcode opcode, const Bytes& content) {
  Bytes record;
  append_record(record, opcode, content);
  emit(record);
}

std::uint16_t McapWriter::add_schema(std::string_view name, std::string_view encoding,
                                     std::string_view text) {
  const auto id = static_cast<std::uint16_t>(schemas_.size() + 1);
  Bytes& content = schemas_.emplace_back();
  append(content, id);
  append(content, name);
  append(content, encoding);
  append(content, text);
  append_record(chunk_, Opcode::kSchema, content);
  return id;
}

std::uint16_t McapWriter::add_channel(std::uint16_t schema, std::string_view topic,
                                      std::string_view message_encoding,
                                      const StringMap& metadata) {
  const auto id = static_cast<std::uint16_t>(channels_.size());
  Bytes& content = channels_.emplace_back();
  append(content, id);
  append(content, schema);
  append(content, topic);
  append(content, message_encoding);
  append_map(content, metadata);
  append_record(chunk_, Opcode::kChannel, content);
  index_.emplace_back();
  sequence_.push_back(0);
  return id;
}

void McapWriter::add_metadata(std::string_view name, const StringMap& map) {
  finish_chunk();
  Bytes content;
  append(content, name);
  append_map(content, map);
  metadata_.push_back({offset_, kRecordHeaderBytes + content.size(), std::string(name)});
  emit_record(Opcode::kMetadata, content);
}

void McapWriter::add_attachment(std::string_view name, std::int64_t time_ns,
                                std::span<const std::byte> data) {
  finish_chunk();
  const auto time = static_cast<std::uint64_t>(time_ns);
  Bytes content;
  append(content, time);
  append(content, time);  // when it was made
  append(content, name);
  append(content, kAttachedType);
  append(content, static_cast<std::uint64_t>(data.size()));
  append(content, data);
  append(content, crc(0, content));
  attachments_.push_back(
      {offset_, kRecordHeaderBytes + content.size(), time, data.size(), std::string(name)});
  emit_record(Opcode::kAttachment, content);
}

bool McapWriter::write(std::uint16_t channel, std::int64_t time_ns, std::span<const std::byte> head,
                       std::span<const std::byte> body) {
  if (failed()) return false;
  const auto time = static_cast<std::uint64_t>(time_ns);
  const std::size_t at = chunk_.size();
  const std::size_t content = kMessageHeaderBytes + head.size() + body.size();
  std::array<std::byte, kRecordHeaderBytes + kMessageHeaderBytes> start;
  store(start.data(), static_cast<std::uint8_t>(Opcode::kMessage));
  store(start.data() + 1, static_cast<std::uint64_t>(content));
  store(start.data() + 9, channel);
  store(start.data() + 11, sequence_[channel]++);
  store(start.data() + 15, time);
  store(start.data() + 23, time);
  append(chunk_, std::span<const std::byte>(start));
  append(chunk_, head);
  append(chunk_, body);

  chunk_start_ = chunk_has_messages_ ? std::min(chunk_start_, time) : time;
  chunk_end_ = chunk_has_messages_ ? std::max(chunk_end_, time) : time;
  chunk_has_messages_ = true;
  index_[channel].push_back({time, at});
  Statistics& all = statistics_;
  all.start_time = all.messages == 0 ? time : std::min(all.start_time, time);
  all.end_time = std::max(all.end_time, time);
  ++all.messages;
  ++all.per_channel[channel];
  const auto span = static_cast<std::uint64_t>(options_.chunk_span_ns);
  if (chunk_.size() >= options_.chunk_bytes || chunk_end_ - chunk_start_ >= span) finish_chunk();
  return !failed();
}

void McapWriter::finish_chunk() {
  if (chunk_.empty() || failed()) return;
  std::span<const std::byte> records = chunk_;
  if (options_.compression != Compression::kNone) {
    compress(options_.compression, chunk_, compressed_);
    records = compressed_;
  }
  Chunk chunk;
  chunk.start_time = chunk_has_messages_ ? chunk_start_ : 0;
  chunk.end_time = chunk_has_messages_ ? chunk_end_ : 0;
  chunk.offset = offset_;
  chunk.compressed = records.size();
  chunk.uncompressed = chunk_.size();
  chunk.messages = statistics_.messages - chunked_messages_;
  chunked_messages_ = statistics_.messages;

  const std::uint32_t chunk_crc = crc(0, chunk_);
  Bytes head;
  append(head, chunk.start_time);
  append(head, chunk.end_time);
  append(head, chunk.uncompressed);
  append(head, chunk_crc);
  append(head, mcap_name(options_.compression));
  append(head, chunk.compressed);
  Bytes record;
  append(record, static_cast<std::uint8_t>(Opcode::kChunk));
  append(record, static_cast<std::uint64_t>(head.size() + records.size()));
  append(record, head);
  emit(record);
  if (options_.compression == Compression::kNone) {
    crc_ = joined(crc_, chunk_crc, records.size());
    put(records);
  } else {
    emit(records);
  }
  chunk.length = record.size() + records.size();
  write_indices(chunk);
  chunks_.push_back(std::move(chunk));
  chunk_.clear();
  chunk_has_messages_ = false;
}

void McapWriter::write_indices(Chunk& chunk) {
  const std::uint64_t begin = offset_;
  Bytes records;
  for (std::size_t i = 0; i < index_.size(); ++i) {
    const auto channel = static_cast<std::uint16_t>(i);
    std::vector<IndexEntry>& entries = index_[i];
    if (entries.empty()) continue;
    chunk.index_offsets[channel] = begin + records.size();
    Bytes content;
    append(content, channel);
    append(content, static_cast<std::uint32_t>(entries.size() * 16));
    const std::size_t at = content.size();
    content.resize(at + entries.size() * 16);
    std::byte* out = content.data() + at;
    for (const IndexEntry& entry : entries) {
      store(out, entry.time);
      store(out + 8, entry.offset);
      out += 16;
    }
    append_record(records, Opcode::kMessageIndex, content);
    entries.clear();
  }
  emit(records);
  chunk.index_length = offset_ - begin;
}

Bytes McapWriter::statistics_content() const {
  Bytes content;
  append(content, statistics_.messages);
  append(content, static_cast<std::uint16_t>(schemas_.size()));
  append(content, static_cast<std::uint32_t>(channels_.size()));
  append(content, static_cast<std::uint32_t>(attachments_.size()));
  append(content, static_cast<std::uint32_t>(metadata_.size()));
  append(content, static_cast<std::uint32_t>(chunks_.size()));
  append(content, statistics_.start_time);
  append(content, statistics_.end_time);
  append_map(content, statistics_.per_channel);
  return content;
}

Bytes McapWriter::chunk_index_content(const Chunk& chunk) const {
  Bytes content;
  append(content, chunk.start_time);
  append(content, chunk.end_time);
  append(content, chunk.offset);
  append(content, chunk.length);
  append_map(content, chunk.index_offsets);
  append(content, chunk.index_length);
  append(content, mcap_name(options_.compression));
  append(content, chunk.compressed);
  append(content, chunk.uncompressed);
  return content;
}

void McapWriter::summary_group(Opcode opcode, std::uint64_t start, Bytes& offsets) const {
  if (offset_ == start) return;
  Bytes content;
  append(content, static_cast<std::uint8_t>(opcode));
  append(content, start);
  append(content, offset_ - start);
  append_record(offsets, Opcode::kSummaryOffset, content);
}

void McapWriter::write_summary() {
  const std::uint64_t summary_start = offset_;
  crc_ = 0;
  Bytes offsets;
  std::uint64_t start = offset_;
  for (const Bytes& schema : schemas_) emit_record(Opcode::kSchema, schema);
  summary_group(Opcode::kSchema, start, offsets);
  start = offset_;
  for (const Bytes& channel : channels_) emit_record(Opcode::kChannel, channel);
  summary_group(Opcode::kChannel, start, offsets);
  start = offset_;
  emit_record(Opcode::kStatistics, statistics_content());
  summary_group(Opcode::kStatistics, start, offsets);
  start = offset_;
  for (const Chunk& chunk : chunks_) emit_record(Opcode::kChunkIndex, chunk_index_content(chunk));
  summary_group(Opcode::kChunkIndex, start, offsets);
  start = offset_;
  for (const AttachmentPlace& place : attachments_) {
    Bytes content;
    append(content, place.offset);
    append(content, place.length);
    append(content, place.time);
    append(content, place.time);
    append(content, place.size);
    append(content, place.name);
    append(content, kAttachedType);
    emit_record(Opcode::kAttachmentIndex, content);
  }
  summary_group(Opcode::kAttachmentIndex, start, offsets);
  start = offset_;
  for (const MetadataPlace& place : metadata_) {
    Bytes content;
    append(content, place.offset);
    append(content, place.length);
    append(content, place.name);
    emit_record(Opcode::kMetadataIndex, content);
  }
  summary_group(Opcode::kMetadataIndex, start, offsets);
  const std::uint64_t offset_start = offset_;
  emit(offsets);
  // The CRC covers the summary and the footer up to the CRC itself.
  Bytes footer;
  append(footer, static_cast<std::uint8_t>(Opcode::kFooter));
  append(footer, std::uint64_t{20});
  append(footer, summary_start);
  append(footer, offset_start);
  append(footer, crc(crc_, footer));
  emit(footer);
  emit(kMagic);
}

Status McapWriter::close() {
  finish_chunk();
  Bytes end;
  append(end, crc_);
  emit_record(Opcode::kDataEnd, end);
  write_summary();
  look_at_file();
  const int closed = ::close(file_.release());
  if (closed != 0 && !failed()) fail(std::strerror(errno), offset_);
  if (!failed()) return {};
  return std::unexpected(Error{.message = "the log is incomplete: " + error_,
                               .hint = kept_bytes_ == 0
                                           ? "record the run again"
                                           : "it can be read up to where writing failed",
                               .file = path_,
                               .key = {}});
}

}  // namespace tandem::log
