// Hops from record to record by their lengths: a file of hours has some ten thousand.
#include "log/attachments.hpp"

#include <libdeflate.h>
#include <sys/stat.h>

#include <algorithm>
#include <array>

#include "base/bounds.hpp"
#include "base/open_file.hpp"
#include "log/mcap_format.hpp"
#include "log/mcap_index.hpp"

namespace tandem::log {
namespace {

constexpr const char* kNameOne = "name a log of `tandem run`";

/// What stands before the data. False: it is none.
bool read_title(const Descriptor& file, Attachment& one) {
  Bytes head(std::min<std::uint64_t>(one.bytes, 256));
  if (!read_at(file, one.at, head)) return false;
  ByteReader in(head);
  one.time_ns = static_cast<std::int64_t>(in.number<std::uint64_t>());
  (void)in.number<std::uint64_t>();
  one.name = in.text();
  return in.ok();
}

}  // namespace

Result<std::vector<Attachment>> attachments_of(const std::string& path) {
  const Result<Descriptor> file = open_to_read(path, kNameOne);
  if (!file) return std::unexpected(file.error());
  struct stat found {};
  if (::fstat(file->get(), &found) != 0) found.st_size = 0;
  const auto size = static_cast<std::uint64_t>(found.st_size);
  std::array<std::byte, kMagic.size()> magic{};
  if (!read_at(*file, 0, magic) || magic != kMagic) {
    return std::unexpected(
        Error{.message = "this is no MCAP file", .hint = kNameOne, .file = path, .key = {}});
  }
  std::vector<Attachment> all;
  std::uint64_t at = kMagic.size();
  for (std::array<std::byte, kRecordHeaderBytes> head{}; read_at(*file, at, head);) {
    ByteReader in(head);
    const auto opcode = static_cast<Opcode>(in.number<std::uint8_t>());
    const auto length = in.number<std::uint64_t>();
    at += head.size();
    if (opcode == Opcode::kDataEnd || length > size - at) break;
    Attachment one{.name = {}, .file = path, .at = at, .bytes = length};
    if (opcode == Opcode::kAttachment && read_title(*file, one)) all.push_back(std::move(one));
    at += length;
  }
  return all;
}

Result<Bytes> read_attachment(const Attachment& one) {
  const auto damaged = [&one] {
    return std::unexpected(Error{.message = "the attachment '" + one.name + "' is damaged",
                                 .hint = "take an earlier one, or copy the file again",
                                 .file = one.file,
                                 .key = {}});
  };
  const Result<Descriptor> file = open_to_read(one.file, kNameOne);
  if (!file) return std::unexpected(file.error());
  if (one.bytes > bounds::kLogRecord.most || one.bytes < sizeof(std::uint32_t)) return damaged();
  Bytes content(one.bytes);
  if (!read_at(*file, one.at, content)) return damaged();
  const std::size_t signed_bytes = content.size() - sizeof(std::uint32_t);
  ByteReader in(content);
  (void)in.take(16);
  (void)in.text();
  (void)in.text();
  const auto data = in.take(in.number<std::uint64_t>());
  const auto stated = in.number<std::uint32_t>();
  const auto crc = libdeflate_crc32(0, content.data(), signed_bytes);
  if (!in.ok() || in.left() != 0 || stated != crc) return damaged();
  return Bytes(data.begin(), data.end());
}

}  // namespace tandem::log
