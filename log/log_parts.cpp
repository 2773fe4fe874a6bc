// Names of parts; a folder is listed once.
#include "log/log_parts.hpp"

#include <charconv>
#include <filesystem>

namespace tandem::log {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kEnding = ".mcap";

/// Without ".mcap".
std::string stem_of(const std::string& path) {
  return path.ends_with(kEnding) ? path.substr(0, path.size() - kEnding.size()) : path;
}

}  // namespace

std::string part_path(const std::string& name, std::uint64_t number) {
  if (number == 1) return name;
  return stem_of(name) + "." + std::to_string(number) + std::string(kEnding);
}

std::string branch_path(const std::string& name, std::uint64_t number) {
  return stem_of(name) + ".branch-" + std::to_string(number) + std::string(kEnding);
}

std::pair<std::string, std::uint64_t> branch_of(const std::string& file) {
  constexpr std::string_view kBranch = ".branch-";
  const std::string stem = stem_of(file);
  const std::size_t at = stem.rfind(kBranch);
  std::uint64_t number = 0;
  if (at == std::string::npos || at == 0 || stem.size() == file.size()) return {file, 1};
  const char* const end = stem.data() + stem.size();
  const auto read = std::from_chars(stem.data() + at + kBranch.size(), end, number);
  if (read.ec != std::errc() || read.ptr != end || number < 2) return {file, 1};
  return {stem.substr(0, at) + std::string(kEnding), number};
}

std::optional<PartName> part_of(const std::string& path) {
  if (!path.ends_with(kEnding)) return std::nullopt;
  const std::string stem = stem_of(path);
  const std::size_t dot = stem.rfind('.');
  if (dot == std::string::npos || dot == 0) return std::nullopt;
  std::uint64_t number = 0;
  const char* const end = stem.data() + stem.size();
  const auto read = std::from_chars(stem.data() + dot + 1, end, number);
  if (read.ec != std::errc() || read.ptr != end || number == 0 || stem[dot + 1] == '0')
    return std::nullopt;
  return PartName{stem.substr(0, dot) + std::string(kEnding), number};
}

std::map<std::uint64_t, std::string> parts_of(const std::string& name) {
  std::map<std::uint64_t, std::string> parts;
  const fs::path path(name);
  const fs::path folder = path.has_parent_path() ? path.parent_path() : fs::path(".");
  std::error_code ignored;
  if (fs::exists(path, ignored)) parts.emplace(1, name);
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, ignored)) {
    const auto part = part_of(entry.path().filename().string());
    if (!part || part->number == 1 || part->all != path.filename().string()) continue;
    parts.emplace(part->number, part_path(name, part->number));
  }
  return parts;
}

std::string reason_of_cut(bool being_written) {
  return being_written ? "its run is still writing it"
                       : "its run was killed, or the copy is not whole";
}

std::string hint_of_cut(bool being_written) {
  return reason_of_cut(being_written) + (being_written ? ": wait for its end" : ": copy it again");
}

std::vector<MissingParts> missing_of(const std::vector<LogPart>& parts, bool goes_on) {
  std::vector<MissingParts> missing;
  std::uint64_t next = 1;
  for (const LogPart& part : parts) {
    if (part.number > next) missing.push_back({next, part.number - 1});
    next = part.number + 1;
  }
  if (goes_on) missing.push_back({next, 0});
  return missing;
}

std::string to_string(const MissingParts& missing) {
  const std::string first = std::to_string(missing.first);
  if (missing.last == 0) return "part " + first + " and what follows";
  if (missing.last == missing.first) return "part " + first;
  return "parts " + first + " to " + std::to_string(missing.last);
}

}  // namespace tandem::log
