// A line is written by one call and looked at when it is read: what a killed process or a full disk
// left of one is taken away.
#include "sweep/results.hpp"

#include <fcntl.h>
#include <fmt/core.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <utility>

#include "apps/text/draft.hpp"
#include "apps/text/json_reader.hpp"

namespace tandem::sweep {
namespace {

namespace fs = std::filesystem;
using apps::Json;

constexpr int kFormat = 1;
constexpr std::uint64_t kMostPointsFile = std::uint64_t{64} << 30;

Json optional_json(const std::optional<double>& value) {
  return value ? Json(*value) : Json(nullptr);
}

std::optional<double> optional_of(const Json& object, const char* key) {
  const auto it = object.find(key);
  if (it == object.end() || !it->is_number()) return std::nullopt;
  return it->get<double>();
}

std::unexpected<Error> folder_fails(const std::string& path, const std::string& message,
                                    const std::string& hint) {
  return std::unexpected(Error{.message = message, .hint = hint, .file = path, .key = {}});
}

Json head_json(const SweepHead& head) {
  Json parts = Json::array();
  for (const auto& [name, digest] : head.parts) parts.push_back({{"what", name}, {"is", digest}});
  return {{"sweep", kFormat}, {"points", head.points}, {"parts", parts}};
}

/// What of the head that is there is another; empty: nothing.
std::string difference(const SweepHead& there, const SweepHead& head) {
  for (std::size_t i = 0; i < std::max(there.parts.size(), head.parts.size()); ++i) {
    if (i >= head.parts.size()) return there.parts[i].first;
    if (i >= there.parts.size() || there.parts[i] != head.parts[i]) return head.parts[i].first;
  }
  return there.points == head.points ? "" : "points";
}

/// Whether all in a folder is the draft of a head, which a killed process has left.
bool holds_nothing_else(const std::string& path) {
  std::error_code ignored;
  for (const fs::directory_entry& entry : fs::directory_iterator(path, ignored)) {
    if (!entry.path().filename().string().starts_with("sweep.")) return false;
  }
  return true;
}

Status check_head(const std::string& path, const SweepHead& head) {
  const std::string file = path + "/sweep.json";
  const auto there = head_in(path);
  if (!there) return std::unexpected(there.error());
  if (!*there) {
    if (!holds_nothing_else(path)) {
      return folder_fails(path, "the folder holds something else than a sweep",
                          "choose another: -o FOLDER");
    }
    apps::Draft draft = apps::Draft::file(file);
    const Status written =
        apps::write_file(draft.path(), apps::json_text(head_json(head), 2) + "\n");
    if (!written) return std::unexpected(draft.placed(written.error()));
    return draft.place();
  }
  const std::string other = difference(**there, head);
  if (other.empty()) return {};
  return folder_fails(path, "its points are of another " + other + ": they are not mixed",
                      "choose another folder (-o FOLDER), or remove this one");
}

/// Calls `take` with each whole line, and where it begins. @return where that has said "stop", or
/// the end of the last whole line
template <class Take>
std::size_t each_line(const std::string& text, const Take& take) {
  std::size_t from = 0;
  for (std::size_t end; (end = text.find('\n', from)) != std::string::npos; from = end + 1) {
    if (!take(text.substr(from, end - from), from)) break;
  }
  return from;
}

/// The files of chunks, by their names: all, or those whose names begin so.
std::vector<std::string> chunk_files(const std::string& folder, const std::string& begin) {
  std::vector<std::string> files;
  std::error_code ignored;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder + "/chunks", ignored)) {
    const std::string name = entry.path().filename().string();
    if (name.starts_with(begin) && name.ends_with(".jsonl")) files.push_back(entry.path().string());
  }
  std::ranges::sort(files);
  return files;
}

}  // namespace

std::string PointResult::why() const {
  if (!reason.empty() || passed) return reason;
  for (const runtime::ExpectationResult& one : expectations) {
    if (!one.passed) return one.name + (one.reason.empty() ? "" : ": " + one.reason);
  }
  return ended;
}

std::string line_of(std::uint64_t index, const std::string& name, const PointResult& result) {
  Json expectations = Json::array();
  for (const runtime::ExpectationResult& one : result.expectations) {
    expectations.push_back({{"name", one.name},
                            {"passed", one.passed},
                            {"margin", optional_json(one.margin)},
                            {"unit", one.unit},
                            {"at_s", optional_json(one.at_s)},
                            {"reason", one.reason}});
  }
  return apps::json_text({{"index", index},
                          {"point", name},
                          {"passed", result.passed},
                          {"ended", result.ended},
                          {"reason", result.reason},
                          {"seconds", result.seconds},
                          {"expectations", expectations}});
}

Result<ReadLine> read_line(const std::string& line) {
  const auto json = apps::read_json_object(line);
  if (!json) return std::unexpected(json.error());
  const auto list = json->find("expectations");
  if (!json->contains("index") || !(*json)["index"].is_number_unsigned() || list == json->end() ||
      !list->is_array() || !json->value("point", Json()).is_string())
    return fail("is no line of a sweep");
  ReadLine read{.index = (*json)["index"].get<std::uint64_t>(),
                .name = (*json)["point"].get<std::string>(),
                .result = {}};
  const auto text = [](const Json& object, const char* key) {
    const auto it = object.find(key);
    return it != object.end() && it->is_string() ? it->get<std::string>() : std::string();
  };
  const auto holds = [](const Json& object) {
    const auto it = object.find("passed");
    return it != object.end() && it->is_boolean() && it->get<bool>();
  };
  PointResult& result = read.result;
  result.passed = holds(*json);
  result.ended = text(*json, "ended");
  result.reason = text(*json, "reason");
  result.seconds = optional_of(*json, "seconds").value_or(0.0);
  for (const Json& one : *list) {
    if (!one.is_object()) return fail("is no line of a sweep");
    result.expectations.push_back({.name = text(one, "name"),
                                   .passed = holds(one),
                                   .margin = optional_of(one, "margin"),
                                   .unit = text(one, "unit"),
                                   .at_s = optional_of(one, "at_s"),
                                   .reason = text(one, "reason")});
  }
  return read;
}

Result<std::optional<SweepHead>> head_in(const std::string& folder) {
  const std::string file = folder + "/sweep.json";
  std::error_code ignored;
  if (!fs::exists(file, ignored)) return std::nullopt;
  const auto text = read_file(file, "", kMostOtherBytes);
  if (!text) return std::unexpected(text.error());
  const auto json = apps::read_json_object(*text);
  const auto parts = json ? json->find("parts") : Json::const_iterator();
  if (!json || json->value("sweep", Json()) != kFormat || parts == json->end() ||
      !parts->is_array() || !json->value("points", Json()).is_number_unsigned())
    return folder_fails(file, "is no head of a sweep", "choose another: -o FOLDER");
  SweepHead head{.parts = {}, .points = (*json)["points"].get<std::uint64_t>()};
  for (const Json& part : *parts) {
    const auto text_of = [&](const char* key) {
      const auto it = part.is_object() ? part.find(key) : part.end();
      return it != part.end() && it->is_string() ? it->get<std::string>() : std::string();
    };
    head.parts.emplace_back(text_of("what"), text_of("is"));
  }
  return head;
}

void SweepFolder::keep(std::uint64_t index, PointResult result) {
  auto& kept = results_[static_cast<std::size_t>(index - first_)];
  done_ += kept ? 0 : 1;
  kept = std::move(result);
}

// A line of a chunk that cannot be read costs its point, which is computed again: a node that loses
// power may leave zeros. The one file of a single machine ends with its last line.
Result<std::uint64_t> SweepFolder::take(const Lines& lines) {
  std::optional<std::size_t> wrong;
  const std::size_t end = each_line(lines.text, [&](const std::string& text, std::size_t at) {
    auto line = read_line(text);
    if (!line && lines.of_chunk) return true;
    if (!line || line->index >= lines.points.size() ||
        lines.points.at(line->index).name != line->name) {
      if (lines.of_chunk || at + text.size() + 1 < lines.text.size()) wrong = at;
      return false;
    }
    if (line->index >= first_ && line->index - first_ < results_.size())
      keep(line->index, std::move(line->result));
    return true;
  });
  if (!wrong) return end;
  return folder_fails(lines.file, fmt::format("byte {} begins no point of this sweep", *wrong),
                      "remove the folder, or choose another: -o FOLDER");
}

Status SweepFolder::take_chunks(const Points& points, const std::string& begin) {
  for (const std::string& file : chunk_files(path_, begin)) {
    auto text = read_file(file, "", kMostPointsFile);
    if (!text) return std::unexpected(text.error());
    const auto taken =
        take({.points = points, .file = file, .text = std::move(*text), .of_chunk = true});
    if (!taken) return std::unexpected(taken.error());
  }
  return {};
}

Result<SweepFolder> SweepFolder::open(const std::string& path, const SweepHead& head,
                                      const Points& points) {
  std::error_code problem;
  fs::create_directories(path, problem);
  if (problem)
    return folder_fails(path, "cannot make the folder: " + problem.message(),
                        "choose another: -o FOLDER");
  if (const Status same = check_head(path, head); !same) return std::unexpected(same.error());
  SweepFolder folder;
  folder.path_ = path;
  folder.results_.resize(static_cast<std::size_t>(points.size()));
  const std::string& file = folder.name_ = path + "/points.jsonl";
  folder.file_ = Descriptor(::open(file.c_str(), O_RDWR | O_CREAT | O_APPEND | O_CLOEXEC, 0644));
  if (!folder.file_.valid())
    return folder_fails(file, std::string("cannot be opened: ") + std::strerror(errno),
                        "choose another folder: -o FOLDER");
  if (::flock(folder.file_.get(), LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK)
    return folder_fails(path, "another process is sweeping there", "wait for it");
  auto text = read_all(folder.file_, file, kMostPointsFile);
  if (!text) return std::unexpected(text.error());
  const std::size_t size = text->size();
  const auto taken = folder.take({.points = points, .file = file, .text = std::move(*text)});
  if (!taken) return std::unexpected(taken.error());
  folder.bytes_ = *taken;
  if (folder.bytes_ < size &&
      ::ftruncate(folder.file_.get(), static_cast<off_t>(folder.bytes_)) != 0)
    return folder_fails(file, std::string("cannot be cut: ") + std::strerror(errno), "");
  if (const Status chunks = folder.take_chunks(points, ""); !chunks)
    return std::unexpected(chunks.error());
  return folder;
}

Result<SweepFolder> SweepFolder::open_chunk(const std::string& path, const SweepHead& head,
                                            const Points& points, const Chunk& chunk) {
  std::error_code ignored;
  if (!fs::is_directory(path + "/chunks", ignored))
    return folder_fails(path, "holds no sweep of several machines",
                        "`tandem sweep STUDY --slurm` makes one; is the folder shared?");
  if (const Status same = check_head(path, head); !same) return std::unexpected(same.error());
  SweepFolder folder;
  folder.path_ = path;
  folder.shared_ = true;
  folder.first_ = chunk.first;
  folder.results_.resize(static_cast<std::size_t>(chunk.end - chunk.first));
  const std::string local = path + "/points.jsonl", begin = fmt::format("{}.", chunk.number);
  if (fs::exists(local, ignored)) {
    auto text = read_file(local, "", kMostPointsFile);
    if (!text) return std::unexpected(text.error());
    if (const auto taken = folder.take({.points = points, .file = local, .text = std::move(*text)});
        !taken)
      return std::unexpected(taken.error());
  }
  if (const Status chunks = folder.take_chunks(points, begin); !chunks)
    return std::unexpected(chunks.error());
  folder.name_ = path + "/chunks/" + begin + "XXXXXX.jsonl";
  folder.file_ = Descriptor(::mkostemps(folder.name_.data(), 6, O_APPEND | O_CLOEXEC));
  if (!folder.file_.valid())
    return folder_fails(folder.name_, std::string("cannot be made: ") + std::strerror(errno),
                        "can this machine write to the folder?");
  (void)::fchmod(folder.file_.get(), 0644);
  return folder;
}

std::unexpected<Error> SweepFolder::write_fails(int error) {
  (void)!::ftruncate(file_.get(), static_cast<off_t>(bytes_));
  return folder_fails(name_, std::string("cannot be written: ") + std::strerror(error),
                      "make room; then the same command goes on from here");
}

Status SweepFolder::add(const Point& point, PointResult result) {
  const std::string line = line_of(point.index, point.name, result) + "\n";
  if (const int error = write_all(file_, line); error != 0) return write_fails(error);
  bytes_ += line.size();
  keep(point.index, std::move(result));
  const bool due = std::chrono::steady_clock::now() - synced_ > std::chrono::seconds(1);
  return shared_ && due ? sync() : Status();
}

Status SweepFolder::sync() {
  synced_ = std::chrono::steady_clock::now();
  return ::fdatasync(file_.get()) == 0 ? Status() : write_fails(errno);
}

Result<Progress> progress_in(const std::string& folder) {
  const auto head = head_in(folder);
  if (!head) return std::unexpected(head.error());
  if (!*head)
    return folder_fails(folder, "holds no sweep", "name the folder that `tandem sweep` was given");
  Progress all{.points = (*head)->points, .there = {}};
  all.there.resize(static_cast<std::size_t>(all.points));
  std::vector<std::string> files = chunk_files(folder, "");
  std::error_code ignored;
  if (const std::string local = folder + "/points.jsonl"; fs::exists(local, ignored))
    files.push_back(local);
  for (const std::string& file : files) {
    const auto text = read_file(file, "", kMostPointsFile);
    if (!text) return std::unexpected(text.error());
    (void)each_line(*text, [&](const std::string& words, std::size_t) {
      const auto line = read_line(words);
      if (!line || line->index >= all.points || all.there[line->index]) return true;
      all.there[line->index] = true;
      ++all.done;
      all.failed += line->result.passed ? 0 : 1;
      all.seconds += line->result.seconds;
      return true;
    });
  }
  return all;
}

}  // namespace tandem::sweep
