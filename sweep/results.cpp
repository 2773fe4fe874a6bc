// A line is written by one call and looked at when it is read: what a killed process or a full disk
// left of one is taken away.
#include "sweep/results.hpp"

#include <fcntl.h>
#include <fmt/core.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
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
  for (const auto& [name, digest] : head.parts)
    parts.push_back({{"what", name}, {"sha256", digest}});
  return {{"sweep", kFormat}, {"points", head.points}, {"parts", parts}};
}

/// What of the head that is there is another; empty: nothing.
std::string difference(const Json& there, const SweepHead& head) {
  if (there.value("sweep", 0) != kFormat) return "format";
  const Json parts = there.value("parts", Json::array());
  for (std::size_t i = 0; i < std::max(parts.size(), head.parts.size()); ++i) {
    if (i >= head.parts.size()) return parts[i].value("what", "part");
    const auto& [name, digest] = head.parts[i];
    if (i >= parts.size() || parts[i].value("what", "") != name ||
        parts[i].value("sha256", "") != digest)
      return name;
  }
  return there.value("points", std::uint64_t{0}) == head.points ? "" : "points";
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
  std::error_code ignored;
  if (!fs::exists(file, ignored)) {
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
  const auto text = read_file(file, "", kMostOtherBytes);
  if (!text) return std::unexpected(text.error());
  const auto there = apps::read_json_object(*text);
  if (!there) return folder_fails(file, "is no head of a sweep", "choose another: -o FOLDER");
  const std::string other = difference(*there, head);
  if (other.empty()) return {};
  return folder_fails(path, "its points are of another " + other + ": they are not mixed",
                      "choose another folder (-o FOLDER), or remove this one");
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
  const std::string file = path + "/points.jsonl";
  folder.file_ = Descriptor(::open(file.c_str(), O_RDWR | O_CREAT | O_APPEND | O_CLOEXEC, 0644));
  if (!folder.file_.valid())
    return folder_fails(file, std::string("cannot be opened: ") + std::strerror(errno),
                        "choose another folder: -o FOLDER");
  if (::flock(folder.file_.get(), LOCK_EX | LOCK_NB) != 0)
    return folder_fails(path, "another process is sweeping there", "wait for it");
  const auto text = read_all(folder.file_, file, kMostPointsFile);
  if (!text) return std::unexpected(text.error());
  for (std::size_t from = 0; from < text->size();) {
    const std::size_t end = text->find('\n', from);
    auto line = end == std::string::npos ? Result<ReadLine>(fail("is cut"))
                                         : read_line(text->substr(from, end - from));
    if (!line || line->index >= points.size() || points.at(line->index).name != line->name) {
      if (end == std::string::npos || end + 1 == text->size()) break;
      return folder_fails(file, fmt::format("byte {} begins no point of this sweep", from),
                          "remove the folder, or choose another: -o FOLDER");
    }
    auto& result = folder.results_[static_cast<std::size_t>(line->index)];
    folder.done_ += result ? 0 : 1;
    result = std::move(line->result);
    from = end + 1;
    folder.bytes_ = from;
  }
  if (folder.bytes_ < text->size() &&
      ::ftruncate(folder.file_.get(), static_cast<off_t>(folder.bytes_)) != 0)
    return folder_fails(file, std::string("cannot be cut: ") + std::strerror(errno), "");
  return folder;
}

Status SweepFolder::add(const Point& point, PointResult result) {
  const std::string line = line_of(point.index, point.name, result) + "\n";
  if (const int error = write_all(file_, line); error != 0) {
    (void)!::ftruncate(file_.get(), static_cast<off_t>(bytes_));
    return folder_fails(path_ + "/points.jsonl",
                        std::string("cannot be written: ") + std::strerror(error),
                        "make room; then the same command goes on from here");
  }
  bytes_ += line.size();
  auto& kept = results_[static_cast<std::size_t>(point.index)];
  done_ += kept ? 0 : 1;
  kept = std::move(result);
  return {};
}

}  // namespace tandem::sweep
