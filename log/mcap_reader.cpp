// Streams records; chunks are decompressed one at a time, and a file that ends inside a chunk is
// read up to the last whole one.
#include "log/mcap_reader.hpp"

#include <libdeflate.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "base/bounds.hpp"
#include "log/compression.hpp"

namespace tandem::log {
namespace {

constexpr std::size_t kAheadBytes = std::size_t{1} << 16;
constexpr const char* kNameALog = "name a log of `tandem run`";
constexpr std::uint64_t kSmallLog = std::uint64_t{256} << 20;  // that any file may unpack to

/// Whether a record holds what is kept; others, such as attachments, are passed over unread.
bool is_read(Opcode opcode) {
  switch (opcode) {
    case Opcode::kHeader:
    case Opcode::kSchema:
    case Opcode::kChannel:
    case Opcode::kMessage:
    case Opcode::kChunk:
    case Opcode::kMetadata:
    case Opcode::kDataEnd: return true;
    default: return false;
  }
}

Error file_error(const std::string& path, std::string message, std::string hint) {
  return {.message = std::move(message), .hint = std::move(hint), .file = path, .key = {}};
}

StringMap read_map(ByteReader& in) {
  StringMap map;
  ByteReader pairs(in.take(in.number<std::uint32_t>()));
  while (pairs.ok() && pairs.left() > 0) {
    std::string key = pairs.text();
    std::string value = pairs.text();
    map.emplace_back(std::move(key), std::move(value));
  }
  return map;
}

SchemaRecord read_schema(ByteReader& in) {
  SchemaRecord schema;
  schema.id = in.number<std::uint16_t>();
  schema.name = in.text();
  schema.encoding = in.text();
  schema.text = in.text();
  return schema;
}

ChannelRecord read_channel(ByteReader& in) {
  ChannelRecord channel;
  channel.id = in.number<std::uint16_t>();
  channel.schema_id = in.number<std::uint16_t>();
  channel.topic = in.text();
  channel.message_encoding = in.text();
  (void)read_map(in);
  return channel;
}

}  // namespace

std::unexpected<Error> McapReader::damaged(std::string what) const {
  return std::unexpected(
      file_error(path_, std::move(what), "the file is damaged; record the run again"));
}

Result<McapReader> McapReader::open(const std::string& path) {
  Result<Descriptor> file = open_to_read(path, kNameALog);
  if (!file) return std::unexpected(file.error());
  return open(std::make_shared<const Descriptor>(std::move(*file)), path);
}

Result<McapReader> McapReader::open(std::shared_ptr<const Descriptor> file,
                                    const std::string& path) {
  McapReader reader;
  reader.path_ = path;
  reader.file_ = std::move(file);
  struct stat found {};
  if (::fstat(reader.file_->get(), &found) != 0) return reader.damaged("reading failed");
  reader.bytes_ = reader.left_ = static_cast<std::uint64_t>(found.st_size);
  std::array<std::byte, kMagic.size()> magic{};
  if (reader.left_ < magic.size() || !reader.read(magic) || magic != kMagic) {
    return std::unexpected(file_error(path, "this is no MCAP file", kNameALog));
  }
  return reader;
}

/// The next bytes. @pre as many are left
bool McapReader::read(std::span<std::byte> into) {
  while (!into.empty()) {
    if (ahead_at_ == ahead_.size()) {
      ahead_.resize(kAheadBytes);
      ssize_t size = 0;
      do {
        size =
            ::pread(file_->get(), ahead_.data(), ahead_.size(), static_cast<off_t>(bytes_ - left_));
      } while (size < 0 && errno == EINTR);
      ahead_.resize(static_cast<std::size_t>(std::max<ssize_t>(size, 0)));
      ahead_at_ = 0;
      if (size <= 0) return false;
    }
    const std::size_t size = std::min(into.size(), ahead_.size() - ahead_at_);
    std::memcpy(into.data(), ahead_.data() + ahead_at_, size);
    ahead_at_ += size;
    left_ -= size;
    into = into.subspan(size);
  }
  return true;
}

/// @pre as many bytes are left
void McapReader::skip(std::uint64_t bytes) {
  ahead_at_ += static_cast<std::size_t>(std::min<std::uint64_t>(bytes, ahead_.size() - ahead_at_));
  left_ -= bytes;
}

Result<std::optional<MessageView>> McapReader::next() {
  for (;;) {
    auto found = next_in_chunk();
    if (!found || found->has_value()) return found;
    if (ended_) return std::nullopt;
    if (Status read = read_record(); !read) return std::unexpected(read.error());
  }
}

Status McapReader::read_record() {
  std::array<std::byte, kRecordHeaderBytes> head{};
  std::uint64_t length = 0;
  if (left_ >= head.size()) {
    if (!read(head)) return damaged("reading failed");
    ByteReader in(std::span<const std::byte>(head).subspan(1));
    length = in.number<std::uint64_t>();
  } else {
    ended_ = truncated_ = true;
    return {};
  }
  if (length > left_) {
    ended_ = truncated_ = true;
    return {};
  }
  const auto opcode = static_cast<Opcode>(head[0]);
  if (!is_read(opcode)) {
    skip(length);
    return {};
  }
  if (length > bounds::kLogRecord.most) return std::unexpected(beyond(bounds::kLogRecord, path_));
  record_.resize(static_cast<std::size_t>(length));
  if (!read(record_)) return damaged("reading failed");
  if (opcode == Opcode::kChunk) return open_chunk(record_);
  if (opcode != Opcode::kMessage) return take(opcode, record_);
  // A file without chunks: next_in_chunk() finds the message as one of its own.
  chunk_.assign(head.begin(), head.end());
  append(chunk_, std::span<const std::byte>(record_));
  chunk_at_ = 0;
  return {};
}

Status McapReader::take(Opcode opcode, std::span<const std::byte> content) {
  ByteReader in(content);
  if (Status within = count_text(is_read(opcode) ? content.size() : 0); !within) return within;
  switch (opcode) {
    case Opcode::kHeader: profile_ = in.text(); break;
    case Opcode::kSchema: {
      SchemaRecord schema = read_schema(in);
      schemas_[schema.id] = std::move(schema);
      break;
    }
    case Opcode::kChannel: {
      ChannelRecord channel = read_channel(in);
      channels_[channel.id] = std::move(channel);
      break;
    }
    case Opcode::kMetadata: {
      std::string name = in.text();
      metadata_[std::move(name)] = read_map(in);
      break;
    }
    case Opcode::kDataEnd: ended_ = true; break;
    default: break;  // indices and what a later version adds
  }
  if (!in.ok()) return damaged("a record is shorter than its content");
  return {};
}

Status McapReader::count_text(std::size_t bytes) {
  texts_ += bytes;
  if (texts_ <= bounds::kLogTexts.most) return {};
  return std::unexpected(beyond(bounds::kLogTexts, path_));
}

Status McapReader::open_chunk(std::span<const std::byte> content) {
  ByteReader in(content);
  (void)in.number<std::uint64_t>();  // start time
  (void)in.number<std::uint64_t>();  // end time
  const auto size = in.number<std::uint64_t>();
  const auto crc = in.number<std::uint32_t>();
  const auto compression = compression_of(in.text());
  const auto records = in.take(in.number<std::uint64_t>());
  if (!in.ok()) return damaged("a chunk is shorter than its content");
  if (!compression) return damaged(compression.error().message);
  if (size > bounds::kLogRecord.most) return std::unexpected(beyond(bounds::kLogRecord, path_));
  unpacked_ += size;
  if (unpacked_ > kSmallLog && unpacked_ / bounds::kLogGrowth.most > bytes_)
    return std::unexpected(beyond(bounds::kLogGrowth, path_));
  if (Status done = decompress(*compression, records, size, chunk_); !done) {
    return damaged(done.error().message);
  }
  chunk_at_ = 0;
  const std::uint32_t found = libdeflate_crc32(0, chunk_.data(), chunk_.size());
  if (crc != 0 && crc != found) return damaged("a chunk's checksum does not fit");
  return {};
}

Result<std::optional<MessageView>> McapReader::next_in_chunk() {
  while (chunk_at_ < chunk_.size()) {
    ByteReader in(std::span<const std::byte>(chunk_).subspan(chunk_at_));
    const auto opcode = static_cast<Opcode>(in.number<std::uint8_t>());
    const auto content = in.take(in.number<std::uint64_t>());
    if (!in.ok()) return damaged("a chunk ends in the middle of a record");
    chunk_at_ += kRecordHeaderBytes + content.size();
    if (opcode != Opcode::kMessage) {
      if (Status done = take(opcode, content); !done) return std::unexpected(done.error());
      continue;
    }
    ByteReader body(content);
    MessageView message;
    message.channel = body.number<std::uint16_t>();
    message.sequence = body.number<std::uint32_t>();
    message.time_ns = static_cast<std::int64_t>(body.number<std::uint64_t>());
    (void)body.number<std::uint64_t>();  // publish time
    message.data = body.rest();
    if (!body.ok()) return damaged("a message is shorter than its head");
    if (!channels_.contains(message.channel)) return damaged("a message's channel is unknown");
    return message;
  }
  return std::nullopt;
}

}  // namespace tandem::log
