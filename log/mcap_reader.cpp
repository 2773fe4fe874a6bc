// Streams records; chunks are decompressed one at a time, and a file that ends inside a chunk is
// read up to the last whole one. Behind a damaged record reading goes on where the index at the
// file's end says, or where the record's own length does.
#include "log/mcap_reader.hpp"

#include <libdeflate.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <utility>

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

/// Whether Tandem writes such a record into a file's data. Its messages are all in chunks.
bool is_of_tandem(Opcode opcode, std::span<const std::byte> content) {
  switch (opcode) {
    case Opcode::kChunk:
    case Opcode::kAttachment:
    case Opcode::kMetadata: return true;
    case Opcode::kDataEnd: return content.size() == sizeof(std::uint32_t);
    case Opcode::kMessageIndex: {
      ByteReader in(content);
      (void)in.number<std::uint16_t>();  // the channel
      const auto length = in.number<std::uint32_t>();
      return in.ok() && length == in.left();
    }
    default: return false;
  }
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

std::unexpected<Error> McapReader::unreadable() const {
  return std::unexpected(file_error(path_, "reading failed", "copy the file from its disk again"));
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
  if (::fstat(reader.file_->get(), &found) != 0) return reader.unreadable();
  reader.bytes_ = reader.left_ = static_cast<std::uint64_t>(found.st_size);
  reader.index_ = read_index(*reader.file_, reader.bytes_);
  std::array<std::byte, kMagic.size()> magic{};
  const bool begins = reader.left_ >= magic.size() && reader.read(magic) && magic == kMagic;
  if (!begins && reader.index_.data_end == 0)  // its end may say so, too
    return std::unexpected(file_error(path, "this is no MCAP file", kNameALog));
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
    crc_ = libdeflate_crc32(crc_, into.data(), size);
    ahead_at_ += size;
    left_ -= size;
    into = into.subspan(size);
  }
  return true;
}

/// What it passes over counts in the checksum, where there is one to compare with.
/// @pre as many bytes are left
bool McapReader::skip(std::uint64_t bytes) {
  while (ours_ && bytes > 0) {
    std::array<std::byte, 4096> passed;
    const auto size = static_cast<std::size_t>(std::min<std::uint64_t>(bytes, passed.size()));
    if (!read(std::span(passed).first(size))) return false;
    bytes -= size;
  }
  ahead_at_ += static_cast<std::size_t>(std::min<std::uint64_t>(bytes, ahead_.size() - ahead_at_));
  left_ -= bytes;
  return true;
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
  record_crc_ = crc_;
  const std::uint64_t at = bytes_ - left_;
  const bool indexed = index_.data_end > 0;
  if (indexed && at == index_.data_end) return end(false);  // without the record that says so
  const bool more = next_place_ < index_.places.size();
  if (more && index_.places[next_place_].at == at) return read_placed(index_.places[next_place_++]);
  const std::uint64_t limit = more ? index_.places[next_place_].at : index_.data_end;
  const std::uint64_t room = indexed ? limit - at : left_;
  std::array<std::byte, kRecordHeaderBytes> head{};
  std::uint64_t length = room;
  if (room >= head.size()) {
    if (!read(head)) return unreadable();
    ByteReader in(std::span<const std::byte>(head).subspan(1));
    length = in.number<std::uint64_t>();
  }
  Damage place{.at = at, .bytes = room};
  if (room < head.size() || length > room - head.size()) {
    if (indexed) return pass_over(std::move(place), limit, "its length is wrong; it is left out");
    ended_ = truncated_ = true;
    return {};
  }
  place.bytes = head.size() + length;
  const auto opcode = static_cast<Opcode>(head[0]);
  if (!ours_ && !is_read(opcode)) {
    if (!skip(length)) return unreadable();
    return {};
  }
  if (length > bounds::kLogRecord.most) {
    const Error most = beyond(bounds::kLogRecord, path_);
    if (!ours_) return std::unexpected(most);
    return pass_over(std::move(place), at + head.size() + length, "it " + most.message);
  }
  record_.resize(static_cast<std::size_t>(length));
  if (!read(record_)) return unreadable();
  if (ours_ && !is_of_tandem(opcode, record_))
    return note(std::move(place), "its kind is wrong; it is left out");
  return take_record(opcode, std::move(place));
}

/// Reads a record whose place and kind the index says, whatever its head does.
Status McapReader::read_placed(const RecordPlace& place) {
  std::array<std::byte, kRecordHeaderBytes> head{};
  const std::uint64_t length = place.bytes - head.size();
  if (length > bounds::kLogRecord.most) return std::unexpected(beyond(bounds::kLogRecord, path_));
  record_.resize(static_cast<std::size_t>(length));
  if (!read(head) || !read(record_) || !skip(place.end - place.at - place.bytes))
    return unreadable();
  return take_record(place.opcode, {.at = place.at,
                                    .bytes = place.bytes,
                                    .chunk = place.opcode == Opcode::kChunk,
                                    .first_ns = place.first_ns,
                                    .last_ns = place.last_ns});
}

/// Goes on at `to`.
Status McapReader::pass_over(Damage place, std::uint64_t to, std::string what) {
  if (!skip(to - (bytes_ - left_))) return unreadable();
  return note(std::move(place), std::move(what));
}

/// Takes `record_`, which stands at `place`.
Status McapReader::take_record(Opcode opcode, Damage place) {
  if (opcode == Opcode::kChunk) return open_chunk(std::move(place));
  if (opcode != Opcode::kMessage) {
    const auto whole = take(opcode, record_);
    if (!whole) return std::unexpected(whole.error());
    return *whole ? Status()
                  : note(std::move(place), "it is shorter than its content; it is left out");
  }
  // A file without chunks: next_in_chunk() finds the message as one of its own.
  chunk_.clear();
  append(chunk_, static_cast<std::uint8_t>(opcode));
  append(chunk_, static_cast<std::uint64_t>(record_.size()));
  append(chunk_, std::span<const std::byte>(record_));
  chunk_at_ = 0;
  chunk_place_ = std::move(place);
  return {};
}

Result<bool> McapReader::take(Opcode opcode, std::span<const std::byte> content) {
  ByteReader in(content);
  if (Status within = count_text(is_read(opcode) ? content.size() : 0); !within)
    return std::unexpected(within.error());
  switch (opcode) {
    case Opcode::kHeader:
      profile_ = in.text();
      ours_ = in.text() == "tandem";
      break;
    case Opcode::kSchema: {
      SchemaRecord schema = read_schema(in);
      if (in.ok()) schemas_[schema.id] = std::move(schema);
      break;
    }
    case Opcode::kChannel: {
      ChannelRecord channel = read_channel(in);
      if (in.ok()) channels_[channel.id] = std::move(channel);
      break;
    }
    case Opcode::kMetadata: {
      std::string name = in.text();
      auto map = read_map(in);
      if (!map) return false;
      metadata_[std::move(name)] = std::move(*map);
      break;
    }
    case Opcode::kDataEnd: {
      const auto stated = in.number<std::uint32_t>();  // 0: there is none
      const Status ended = end(in.ok() && (stated == 0 || stated == record_crc_));
      if (!ended) return std::unexpected(ended.error());
      return true;
    }
    default: break;  // indices and what a later version adds
  }
  return in.ok();
}

/// The end of the data. @param whole  by the file's own checksum
Status McapReader::end(bool whole) {
  ended_ = true;
  if (!ours_ || !damage_.empty()) return {};
  const bool all_here = index_.data_end > 0;  // it has every chunk
  const Damage file{.bytes = bytes_, .loses_messages = !whole && !all_here};
  if (!whole && !all_here) return note(file, "its checksum is wrong; messages may be left out");
  if (!whole) return note(file, "a bit outside of the messages is wrong; they are all here");
  if (index_.damaged) return note(file, "its index at the end is wrong; the messages are all here");
  return {};
}

/// Keeps a damage. What the first chunks say of topics may have been in it: the index says it, too.
Status McapReader::note(Damage damage, std::string what) {
  if (damage_.size() == bounds::kLogDamage.most)
    return std::unexpected(beyond(bounds::kLogDamage, path_));
  damage.what = std::move(what);
  // The index of a file of Tandem has every chunk: nothing else has messages.
  if (!damage.chunk && ours_ && index_.data_end > 0) damage.loses_messages = false;
  damage_.push_back(std::move(damage));
  for (const auto& [opcode, content] : std::exchange(index_.texts, {}))
    if (const auto taken = take(opcode, content); !taken) return std::unexpected(taken.error());
  return {};
}

Status McapReader::leave_chunk(std::string what) {
  chunk_.clear();
  chunk_at_ = 0;
  return note(chunk_place_, std::move(what) + "; its messages are left out");
}

Status McapReader::count_text(std::size_t bytes) {
  texts_ += bytes;
  if (texts_ <= bounds::kLogTexts.most) return {};
  return std::unexpected(beyond(bounds::kLogTexts, path_));
}

/// Opens the chunk in `record_`.
Status McapReader::open_chunk(Damage place) {
  ByteReader in(record_);
  const auto first = static_cast<std::int64_t>(in.number<std::uint64_t>());
  const auto last = static_cast<std::int64_t>(in.number<std::uint64_t>());
  if (!place.chunk) {  // else the index has said them
    place.first_ns = first;
    place.last_ns = last;
  }
  place.chunk = true;
  chunk_place_ = std::move(place);
  const auto size = in.number<std::uint64_t>();
  const auto crc = in.number<std::uint32_t>();
  const auto compression = compression_of(in.text());
  const auto records = in.take(in.number<std::uint64_t>());
  if (!in.ok()) return leave_chunk("it is shorter than its content");
  if (!compression) return leave_chunk(compression.error().message);
  if (size > bounds::kLogRecord.most)
    return leave_chunk("it " + beyond(bounds::kLogRecord, path_).message);
  unpacked_ += size;
  if (unpacked_ > kSmallLog && unpacked_ / bounds::kLogGrowth.most > bytes_)
    return std::unexpected(beyond(bounds::kLogGrowth, path_));
  if (Status done = decompress(*compression, records, size, chunk_); !done)
    return leave_chunk(done.error().message);
  chunk_at_ = 0;
  const std::uint32_t found = libdeflate_crc32(0, chunk_.data(), chunk_.size());
  if (crc != 0 && crc != found) return leave_chunk("its checksum is wrong");
  return {};
}

Result<std::optional<MessageView>> McapReader::next_in_chunk() {
  const auto leave = [this](std::string what) -> Result<std::optional<MessageView>> {
    if (Status left = leave_chunk(std::move(what)); !left) return std::unexpected(left.error());
    return std::nullopt;
  };
  while (chunk_at_ < chunk_.size()) {
    ByteReader in(std::span<const std::byte>(chunk_).subspan(chunk_at_));
    const auto opcode = static_cast<Opcode>(in.number<std::uint8_t>());
    const auto content = in.take(in.number<std::uint64_t>());
    if (!in.ok()) return leave("it ends in the middle of a record");
    chunk_at_ += kRecordHeaderBytes + content.size();
    if (opcode != Opcode::kMessage) {
      const auto whole = take(opcode, content);
      if (!whole) return std::unexpected(whole.error());
      if (!*whole) return leave("a record in it is shorter than its content");
      continue;
    }
    ByteReader body(content);
    MessageView message;
    message.channel = body.number<std::uint16_t>();
    message.sequence = body.number<std::uint32_t>();
    message.time_ns = static_cast<std::int64_t>(body.number<std::uint64_t>());
    (void)body.number<std::uint64_t>();  // publish time
    message.data = body.rest();
    if (!body.ok()) return leave("a message in it is shorter than its head");
    if (channels_.contains(message.channel)) return message;
    if (!damage_.empty() && damage_.back().at == chunk_place_.at) continue;  // it is said
    Status noted = note(chunk_place_, "messages of an unknown channel in it are left out");
    if (!noted) return std::unexpected(noted.error());
  }
  return std::nullopt;
}

}  // namespace tandem::log
