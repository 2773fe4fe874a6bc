// What a run before left is read from the files' own summaries; only one that was cut is read
// whole.
#include "log/kept_files.hpp"

#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <filesystem>
#include <memory>
#include <tuple>

#include "log/event.hpp"
#include "log/log_parts.hpp"
#include "log/mcap_index.hpp"
#include "log/mcap_reader.hpp"

namespace tandem::log {
namespace {

namespace fs = std::filesystem;

constexpr char kStops[] = "stops", kNoStop[] = "none", kEnded[] = "ended";

/// Whether some run still writes it: it has a lock on it (McapWriter::open).
bool is_held(const Descriptor& file) {
  if (::flock(file.get(), LOCK_SH | LOCK_NB) != 0) return true;
  ::flock(file.get(), LOCK_UN);
  return false;
}

/// The last record "result" of a file that was closed; empty: there is none.
StringMap result_of(const Descriptor& file, const McapIndex& index) {
  constexpr std::uint64_t kMostBytes = 16 << 20;
  for (auto place = index.places.rbegin(); place != index.places.rend(); ++place) {
    if (place->opcode != Opcode::kMetadata || place->bytes > kMostBytes) continue;
    Bytes record(place->bytes);
    if (!read_at(file, place->at, record)) continue;
    ByteReader in{std::span<const std::byte>(record).subspan(kRecordHeaderBytes)};
    if (in.text() != kResultRecord) continue;
    if (auto map = read_map(in)) return std::move(*map);
  }
  return {};
}

/// The order in which files were written: run, branch, part.
std::tuple<std::uint64_t, std::uint64_t, std::uint64_t> order_of(const std::string& file,
                                                                 const std::string& name) {
  const auto part = part_of(file);
  const auto [first, branch] = branch_of(part ? part->all : file);
  return {run_number(first, name), branch, part ? part->number : 1};
}

}  // namespace

std::uint64_t run_number(const std::string& file, const std::string& name) {
  if (!file.starts_with(name + "-") || !file.ends_with(".mcap")) return 0;
  const char* const begin = file.data() + name.size() + 1;
  const char* const end = file.data() + file.size();
  std::uint64_t number = 0;
  const auto read = std::from_chars(begin, end, number);
  return read.ec == std::errc() && read.ptr != end && *read.ptr == '.' ? number : 0;
}

/// Nothing: it is no log, or not over.
std::optional<KeptFiles::File> KeptFiles::look_at(const std::string& path) {
  struct stat found {};
  if (::lstat(path.c_str(), &found) != 0 || !S_ISREG(found.st_mode)) return std::nullopt;
  auto opened = open_to_read(path, "");
  if (!opened || is_held(*opened)) return std::nullopt;
  const auto shared = std::make_shared<const Descriptor>(std::move(*opened));
  File file{.path = path, .bytes = static_cast<std::uint64_t>(found.st_size), .earlier = true};
  const auto note_time = [&file](std::int64_t first_ns, std::int64_t last_ns) {
    if (file.first_ns == kNever || first_ns < file.first_ns) file.first_ns = first_ns;
    file.last_ns = std::max(file.last_ns, last_ns);
  };
  const McapIndex index = read_index(*shared, file.bytes);
  const StringMap result = result_of(*shared, index);
  if (const std::string stops = value_of(result, kStops); !stops.empty()) {
    for (const RecordPlace& place : index.places)
      if (place.opcode == Opcode::kChunk) note_time(place.first_ns, place.last_ns);
    if (stops == kNoStop) return file;
    const char* const end = stops.data() + stops.size();
    const auto first = std::from_chars(stops.data(), end, file.first_stop_ns);
    if (first.ptr != end) std::from_chars(first.ptr + 1, end, file.last_stop_ns);
    return file;
  }
  auto reader = McapReader::open(shared, path);
  if (!reader) return std::nullopt;
  const auto note_stop = [&file](std::int64_t time_ns) {
    if (file.first_stop_ns == kNever) file.first_stop_ns = time_ns;
    file.last_stop_ns = time_ns;
  };
  for (auto message = reader->next(); message && *message; message = reader->next()) {
    const MessageView& view = **message;
    note_time(view.time_ns, view.time_ns);
    if (reader->channels().at(view.channel).topic != "/tandem/event") continue;
    if (view.data.size() < sizeof(std::uint32_t)) continue;
    const auto event = decode_event(view.data.subspan(sizeof(std::uint32_t)));
    if (event && is_stop(event->event)) note_stop(view.time_ns);
  }
  // The loop crashed or hung: no event of it could be written.
  if (!value_of(result, kEnded).empty() && file.last_ns != kNever) note_stop(file.last_ns);
  return file;
}

void KeptFiles::take_over(const std::string& folder, const std::string& name) {
  std::vector<std::string> files;
  std::error_code ignored;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, ignored)) {
    std::string file = entry.path().filename().string();
    if (run_number(file, name) > 0) files.push_back(std::move(file));
  }
  std::ranges::sort(files, {}, [&name](const std::string& file) { return order_of(file, name); });
  for (const std::string& file : files) {
    auto found = look_at((fs::path(folder) / file).string());
    if (!found) continue;
    found->stays = found->stays || present_.stays;  // soon after a fault
    present_ = std::move(*found);
    if (present_.first_stop_ns != kNever) {
      const std::int64_t last_stop_ns = present_.last_stop_ns;
      note_stop(present_.first_stop_ns);
      present_.last_stop_ns = last_stop_ns;
    }
    const std::uint64_t bytes = present_.bytes;
    std::string path = std::move(present_.path);
    end(std::move(path), bytes);
  }
}

void KeptFiles::note(std::int64_t time_ns) noexcept {
  if (present_.first_ns == kNever) present_.first_ns = time_ns;
  present_.last_ns = std::max(present_.last_ns, time_ns);
}

void KeptFiles::note_stop(std::int64_t time_ns) {
  if (present_.first_stop_ns == kNever) present_.first_stop_ns = time_ns;
  present_.last_stop_ns = time_ns;
  if (limits_.keep_before_fault_ns == 0) return;
  present_.stays = true;
  std::int64_t before_ns = limits_.keep_before_fault_ns;
  if (present_.first_ns != kNever) before_ns -= time_ns - present_.first_ns;
  for (auto file = ended_.rbegin(); file != ended_.rend() && before_ns > 0; ++file) {
    if (!file->stays) total_bytes_ -= file->bytes;
    file->stays = true;
    before_ns -= file->length_ns();
  }
}

StringMap KeptFiles::stops() const {
  if (present_.first_stop_ns == kNever) return {{kStops, kNoStop}};
  return {{kStops,
           std::to_string(present_.first_stop_ns) + " " + std::to_string(present_.last_stop_ns)}};
}

void KeptFiles::end(std::string path, std::uint64_t bytes) {
  File next;
  next.stays = limits_.keep_before_fault_ns > 0 && present_.last_stop_ns != kNever &&
               present_.last_ns - present_.last_stop_ns < kAfterFault_ns;
  present_.path = std::move(path);
  present_.bytes = bytes;
  if (!present_.stays) total_bytes_ += bytes;
  if (!present_.earlier) own_bytes_ += bytes;
  ended_.push_back(std::move(present_));
  present_ = std::move(next);
}

/// False: none may go.
bool KeptFiles::remove_oldest() {
  const auto oldest = std::ranges::find(ended_, false, &File::stays);
  if (oldest == ended_.end()) return false;
  (void)::unlink(oldest->path.c_str());  // one that somebody took away is gone, too
  total_bytes_ -= oldest->bytes;
  if (!oldest->earlier) own_bytes_ -= oldest->bytes;
  ++(oldest->earlier ? earlier_removed_ : removed_);
  ended_.erase(oldest);
  return true;
}

void KeptFiles::keep_totals(std::uint64_t bytes) {
  while (limits_.total_bytes > 0 && total_bytes_ + bytes > limits_.total_bytes) {
    if (!remove_oldest()) break;
  }
  if (limits_.total_ns == 0) return;
  for (;;) {
    const auto oldest = std::ranges::find(ended_, false, &File::stays);
    if (oldest == ended_.end()) return;
    std::int64_t age_ns = length_ns();
    for (auto later = oldest + 1; later != ended_.end(); ++later) age_ns += later->length_ns();
    if (age_ns < limits_.total_ns || !remove_oldest()) return;
  }
}

bool KeptFiles::keep_free(const std::function<std::optional<DiskRoom>()>& room,
                          std::uint64_t more_bytes) {
  for (;;) {
    const auto now = room();
    if (!now || now->free_bytes >= wanted_free(limits_, now->all_bytes) + more_bytes) return true;
    if (!limits_.remove_oldest() || !remove_oldest()) return false;
  }
}

}  // namespace tandem::log
