// The folder of a sweep. A line is written by one call and looked at when it is read: what a killed
// process or a full disk left of one is taken away.
#include <fcntl.h>
#include <fmt/core.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <limits>
#include <utility>

#include "apps/text/draft.hpp"
#include "apps/text/json_reader.hpp"
#include "sweep/results.hpp"
#include "sweep/slurm_job.hpp"

namespace tandem::sweep {
namespace {

namespace fs = std::filesystem;
using apps::Json;

constexpr int kFormat = 2;
constexpr std::uint64_t kMostPointsFile = std::uint64_t{64} << 30;
constexpr std::uint64_t kNoNumber = std::numeric_limits<std::uint64_t>::max();

std::unexpected<Error> folder_fails(const std::string& path, const std::string& message,
                                    const std::string& hint) {
  return std::unexpected(Error{.message = message, .hint = hint, .file = path, .key = {}});
}

Json head_json(const SweepHead& head) {
  Json parts = Json::array();
  for (const auto& [name, digest] : head.parts) parts.push_back({{"what", name}, {"is", digest}});
  return {{"sweep", kFormat}, {"study", head.study}, {"points", head.points}, {"parts", parts}};
}

/// A point's name, as a number: 16 hexadecimal digits.
std::uint64_t number_in(const std::string& name) {
  std::uint64_t number = 0;
  (void)std::from_chars(name.data(), name.data() + name.size(), number, 16);
  return number;
}

/// What of the head that is there is another; empty: nothing.
std::string difference(const SweepHead& there, const SweepHead& head) {
  for (std::size_t i = 0; i < std::max(there.parts.size(), head.parts.size()); ++i) {
    if (i >= head.parts.size()) return there.parts[i].first;
    if (i >= there.parts.size() || there.parts[i] != head.parts[i]) return head.parts[i].first;
  }
  return {};
}

/// Whether all in a folder is the draft of a head, which a killed process has left.
bool holds_nothing_else(const std::string& path) {
  std::error_code ignored;
  for (const fs::directory_entry& entry : fs::directory_iterator(path, ignored)) {
    if (!entry.path().filename().string().starts_with("sweep.")) return false;
  }
  return true;
}

Status write_head(const std::string& path, const SweepHead& head) {
  apps::Draft draft = apps::Draft::file(path + "/sweep.json");
  const Status written = apps::write_file(draft.path(), apps::json_text(head_json(head), 2) + "\n");
  if (!written) return std::unexpected(draft.placed(written.error()));
  return draft.place();
}

/// Writes it where there is none. @return whether the one that is there is of another study
Result<bool> check_head(const std::string& path, const SweepHead& head) {
  const auto there = head_in(path);
  if (!there) return std::unexpected(there.error());
  if (!*there) {
    if (!holds_nothing_else(path)) {
      return folder_fails(path, "the folder holds something else than a sweep",
                          "choose another: -o FOLDER");
    }
    if (const Status written = write_head(path, head); !written)
      return std::unexpected(written.error());
    return false;
  }
  if (const std::string other = difference(**there, head); !other.empty()) {
    return folder_fails(path, "its points are of another " + other + ": they are not mixed",
                        "choose another folder (-o FOLDER), or remove this one");
  }
  return (*there)->study != head.study || (*there)->points != head.points;
}

/// What was submitted has other points: an element would compute one for another.
Status check_submitted(const std::string& path) {
  const auto job = slurm_job_in(path);
  if (!job) return std::unexpected(job.error());
  if (!*job || (*job)->arrays.empty()) return {};
  return folder_fails(path, "the study has other points than were submitted from here",
                      "tandem sweep cancel FOLDER, remove its slurm.json, then the same command: "
                      "what is done stays done");
}

/// Calls `take` with each whole line, and its number. @return the end of the last one
template <class Take>
std::size_t each_line(const std::string& text, const Take& take) {
  std::size_t from = 0;
  int number = 0;
  for (std::size_t end; (end = text.find('\n', from)) != std::string::npos; from = end + 1)
    take(text.substr(from, end - from), ++number);
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

Result<std::optional<SweepHead>> head_in(const std::string& folder) {
  const std::string file = folder + "/sweep.json";
  std::error_code ignored;
  if (!fs::exists(file, ignored)) return std::nullopt;
  const auto text = read_file(file, "", kMostOtherBytes);
  if (!text) return std::unexpected(text.error());
  const auto json = apps::read_json_object(*text);
  const auto parts = json ? json->find("parts") : Json::const_iterator();
  if (json && json->contains("sweep") && (*json)["sweep"] != kFormat)
    return folder_fails(file, "is of another version of Tandem",
                        "choose another folder: -o FOLDER");
  if (!json || !json->contains("sweep") || parts == json->end() || !parts->is_array() ||
      !json->value("points", Json()).is_number_unsigned() ||
      !json->value("study", Json()).is_string())
    return folder_fails(file, "is no head of a sweep", "choose another: -o FOLDER");
  SweepHead head{.parts = {},
                 .study = (*json)["study"].get<std::string>(),
                 .points = (*json)["points"].get<std::uint64_t>()};
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

/// Which point of the study a line is of; none: it has no such point.
std::optional<std::uint64_t> SweepFolder::number_of(const Points& points, const ReadLine& line) {
  if (line.index < points.size() && points.at(line.index).name == line.name) return line.index;
  if (by_name_.empty()) {
    for (std::uint64_t i = 0; i < points.size(); ++i)
      by_name_.emplace_back(number_in(points.at(i).name), i);
    std::ranges::sort(by_name_);
  }
  const std::uint64_t name = number_in(line.name);
  const auto found = std::ranges::lower_bound(by_name_, std::pair(name, std::uint64_t{0}));
  if (found == by_name_.end() || points.at(found->second).name != line.name) return std::nullopt;
  return found->second;
}

/// A line that cannot be read costs its point, which is computed again: a node that loses power may
/// leave zeros. @return the end of the last whole line
std::size_t SweepFolder::take(const Points& points, const std::string& file,
                              const std::string& text) {
  return each_line(text, [&](const std::string& words, int number) {
    auto line = read_line(words);
    if (!line) {
      damaged_.push_back({.message = "is damaged: its point is computed again",
                          .hint = "",
                          .file = file,
                          .line = number,
                          .key = {}});
      return;
    }
    const std::optional<double> limit_s = line->result.limit_s;
    if (limit_s && *limit_s != points.study().time_limit_s) return;
    const auto index = number_of(points, *line);
    if (!index) {
      others_.push_back(std::move(*line));
    } else if (*index >= first_ && *index - first_ < results_.size()) {
      keep(*index, std::move(line->result));
    }
  });
}

Status SweepFolder::take_chunks(const Points& points, const std::string& begin) {
  for (const std::string& file : chunk_files(path_, begin)) {
    const auto text = read_file(file, "", kMostPointsFile);
    if (!text) return std::unexpected(text.error());
    (void)take(points, file, *text);
  }
  return {};
}

/// Opens the file that is written: no other process has it.
Status SweepFolder::hold(const std::string& file) {
  Descriptor held(::open(file.c_str(), O_RDWR | O_CREAT | O_APPEND | O_CLOEXEC, 0644));
  if (!held.valid())
    return folder_fails(file, std::string("cannot be opened: ") + std::strerror(errno),
                        "choose another folder: -o FOLDER");
  if (::flock(held.get(), LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK)
    return folder_fails(path_, "another process is sweeping there", "wait for it");
  file_ = std::move(held);
  return {};
}

/// Every line with the number that its point has now; of points that the study has no more without
/// one. Those of chunks are among them.
Status SweepFolder::write_anew(const Points& points, bool without_chunks) {
  const std::string file = name_, draft = file + ".part";
  std::string text;
  for (std::uint64_t i = 0; i < points.size(); ++i) {
    const auto& result = results_[static_cast<std::size_t>(i)];
    if (result) text += line_of(i, points.at(i).name, *result) + "\n";
  }
  for (const ReadLine& one : others_) text += line_of(kNoNumber, one.name, one.result) + "\n";
  std::error_code problem;
  fs::remove(draft, problem);
  const Descriptor before = std::move(file_);  // nobody else has the folder meanwhile
  name_ = draft;
  bytes_ = 0;
  if (const Status held = hold(draft); !held) return held;
  if (const int error = write_all(file_, text); error != 0) return write_fails(error);
  bytes_ = text.size();
  if (const Status written = sync(); !written) return written;
  fs::rename(draft, file, problem);
  if (problem)
    return folder_fails(file, "cannot be replaced: " + problem.message(), "is the folder yours?");
  name_ = file;
  if (!without_chunks) return {};
  for (const std::string& chunk : chunk_files(path_, "")) fs::remove(chunk, problem);
  return {};
}

Result<SweepFolder> SweepFolder::open(const std::string& path, const SweepHead& head,
                                      const Points& points) {
  std::error_code problem;
  fs::create_directories(path, problem);
  if (problem)
    return folder_fails(path, "cannot make the folder: " + problem.message(),
                        "choose another: -o FOLDER");
  const auto other = check_head(path, head);
  if (!other) return std::unexpected(other.error());
  if (const Status none = *other ? check_submitted(path) : Status(); !none)
    return std::unexpected(none.error());
  SweepFolder folder;
  folder.path_ = path;
  folder.results_.resize(static_cast<std::size_t>(points.size()));
  const std::string& file = folder.name_ = path + "/points.jsonl";
  if (const Status held = folder.hold(file); !held) return std::unexpected(held.error());
  const auto text = read_all(folder.file_, file, kMostPointsFile);
  if (!text) return std::unexpected(text.error());
  folder.bytes_ = folder.take(points, file, *text);
  const bool damaged = !folder.damaged_.empty();
  if (folder.bytes_ < text->size() &&
      ::ftruncate(folder.file_.get(), static_cast<off_t>(folder.bytes_)) != 0)
    return folder_fails(file, std::string("cannot be cut: ") + std::strerror(errno), "");
  if (const Status chunks = folder.take_chunks(points, ""); !chunks)
    return std::unexpected(chunks.error());
  if (!*other && !damaged) return folder;
  // Elements of an array may write to their files meanwhile: only where the points are others.
  if (const Status written = folder.write_anew(points, *other); !written)
    return std::unexpected(written.error());
  if (const Status known = *other ? write_head(path, head) : Status(); !known)
    return std::unexpected(known.error());
  return folder;
}

Result<SweepFolder> SweepFolder::open_chunk(const std::string& path, const SweepHead& head,
                                            const Points& points, const Chunk& chunk) {
  std::error_code ignored;
  if (!fs::is_directory(path + "/chunks", ignored))
    return folder_fails(path, "holds no sweep of several machines",
                        "`tandem sweep STUDY --slurm` makes one; is the folder shared?");
  const auto other = check_head(path, head);
  if (!other) return std::unexpected(other.error());
  if (*other)
    return folder_fails(path, "the study has other points than were submitted from here",
                        "submit it again");
  SweepFolder folder;
  folder.path_ = path;
  folder.shared_ = true;
  folder.first_ = chunk.first;
  folder.results_.resize(static_cast<std::size_t>(chunk.end - chunk.first));
  const std::string local = path + "/points.jsonl", begin = fmt::format("{}.", chunk.number);
  if (fs::exists(local, ignored)) {
    const auto text = read_file(local, "", kMostPointsFile);
    if (!text) return std::unexpected(text.error());
    (void)folder.take(points, local, *text);
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
    (void)each_line(*text, [&](const std::string& words, int) {
      const auto line = read_line(words);
      if (!line || line->index >= all.points || all.there[line->index]) return;
      all.there[line->index] = true;
      ++all.done;
      all.failed += line->result.passed ? 0 : 1;
      all.seconds += line->result.seconds;
    });
  }
  return all;
}

}  // namespace tandem::sweep
