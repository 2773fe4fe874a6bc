#include "log/mcap_index.hpp"

#include <libdeflate.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>

namespace tandem::log {
namespace {

constexpr std::uint64_t kFooterBytes = kRecordHeaderBytes + 20;
/// The largest summary that is read: that of a day in chunks of 200 ms.
constexpr std::uint64_t kMostSummary = std::uint64_t{128} << 20;

RecordPlace chunk_place(ByteReader& in) {
  RecordPlace place{.opcode = Opcode::kChunk};
  place.first_ns = static_cast<std::int64_t>(in.number<std::uint64_t>());
  place.last_ns = static_cast<std::int64_t>(in.number<std::uint64_t>());
  place.at = in.number<std::uint64_t>();
  place.bytes = in.number<std::uint64_t>();
  (void)in.take(in.number<std::uint32_t>());  // where the message indices are
  place.end = in.number<std::uint64_t>();     // their length, so far
  return place;
}

/// Whether a place is in the data, behind `before`; then its `end` is set.
bool complete(RecordPlace& place, std::uint64_t before, std::uint64_t data_end) {
  const std::uint64_t indices = place.end;
  if (place.at < before || place.at > data_end) return false;
  if (place.bytes < kRecordHeaderBytes || place.bytes > data_end - place.at) return false;
  if (indices > data_end - place.at - place.bytes) return false;
  place.end = place.at + place.bytes + indices;
  return true;
}

/// The records of a summary. False: they contradict each other.
bool read_records(std::span<const std::byte> summary, McapIndex& index) {
  ByteReader all(summary);
  while (all.left() > 0) {
    const auto opcode = static_cast<Opcode>(all.number<std::uint8_t>());
    const auto content = all.take(all.number<std::uint64_t>());
    ByteReader in(content);
    if (opcode == Opcode::kChunkIndex) {
      index.places.push_back(chunk_place(in));
    } else if (opcode == Opcode::kMetadataIndex || opcode == Opcode::kAttachmentIndex) {
      const auto at = in.number<std::uint64_t>();
      index.places.push_back(
          {.opcode = opcode == Opcode::kMetadataIndex ? Opcode::kMetadata : Opcode::kAttachment,
           .at = at,
           .bytes = in.number<std::uint64_t>()});
    } else if (opcode == Opcode::kSchema || opcode == Opcode::kChannel) {
      index.texts.emplace_back(opcode, Bytes(content.begin(), content.end()));
    }
    if (!all.ok() || !in.ok()) return false;
  }
  std::ranges::stable_sort(index.places, {}, &RecordPlace::at);
  std::uint64_t before = kMagic.size();
  for (RecordPlace& place : index.places) {
    if (!complete(place, before, index.data_end)) return false;
    before = place.end;
  }
  return true;
}

}  // namespace

bool read_at(const Descriptor& file, std::uint64_t at, std::span<std::byte> into) {
  while (!into.empty()) {
    const ssize_t size = ::pread(file.get(), into.data(), into.size(), static_cast<off_t>(at));
    if (size < 0 && errno == EINTR) continue;
    if (size <= 0) return false;
    at += static_cast<std::uint64_t>(size);
    into = into.subspan(static_cast<std::size_t>(size));
  }
  return true;
}

McapIndex read_index(const Descriptor& file, std::uint64_t file_bytes) {
  std::array<std::byte, kFooterBytes + kMagic.size()> end{};
  if (file_bytes < kMagic.size() + end.size()) return {};
  const std::uint64_t footer_at = file_bytes - end.size();
  if (!read_at(file, footer_at, end)) return {};
  if (!std::ranges::equal(std::span(end).last<kMagic.size()>(), kMagic)) return {};  // it was cut
  ByteReader in(end);
  const bool footer = static_cast<Opcode>(in.number<std::uint8_t>()) == Opcode::kFooter &&
                      in.number<std::uint64_t>() == kFooterBytes - kRecordHeaderBytes;
  const auto start = in.number<std::uint64_t>();
  (void)in.number<std::uint64_t>();  // where the summary's own index begins
  const auto crc = in.number<std::uint32_t>();
  if (footer && (start == 0 || crc == 0)) return {};  // a writer that makes none
  const bool inside = footer && start >= kMagic.size() && start <= footer_at;
  if (inside && footer_at - start > kMostSummary) return {};
  Bytes summary(inside ? footer_at - start : 0);
  if (!inside || !read_at(file, start, summary)) return {.damaged = true};
  const auto signed_part = std::span(end).first(kFooterBytes - sizeof crc);
  std::uint32_t found = 0;
  if (!summary.empty()) found = libdeflate_crc32(found, summary.data(), summary.size());
  found = libdeflate_crc32(found, signed_part.data(), signed_part.size());
  McapIndex index{.data_end = start};
  if (found != crc || !read_records(summary, index)) return {.damaged = true};
  return index;
}

std::optional<StringMap> read_map(ByteReader& in) {
  StringMap map;
  ByteReader pairs(in.take(in.number<std::uint32_t>()));
  while (pairs.left() > 0) {
    std::string key = pairs.text();
    std::string value = pairs.text();
    map.emplace_back(std::move(key), std::move(value));
  }
  if (!in.ok() || !pairs.ok()) return std::nullopt;
  return map;
}

}  // namespace tandem::log
