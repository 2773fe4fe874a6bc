#include "log/branches.hpp"

#include <filesystem>
#include <map>
#include <optional>

#include "log/info.hpp"
#include "log/log_parts.hpp"
#include "log/mcap_reader.hpp"

namespace tandem::log {
namespace {

namespace fs = std::filesystem;

/// What a log says about itself before its messages.
RunInfo info_of(const std::string& path) {
  auto reader = McapReader::open(path);
  if (!reader || !reader->next()) return {};
  const auto info = reader->metadata().find(kInfoRecord);
  return info == reader->metadata().end() ? RunInfo{} : info_from(info->second);
}

/// The nearest of the logs that the one at `path` goes on from, which begins at `cycle` or before;
/// without a cycle, or where there is none, the first.
std::string ancestor(const std::string& path, const RunInfo& info,
                     std::optional<std::uint64_t> cycle) {
  constexpr int kMost = 1000;  // logs that name each other have no first
  const fs::path folder = fs::path(path).parent_path();
  std::string file = info.branch.of;
  for (int i = 0; i < kMost; ++i) {
    const Branch its = info_of((folder / file).string()).branch;
    if (its.of.empty() || (cycle && its.cycle <= *cycle)) break;
    file = its.of;
  }
  return file;
}

}  // namespace

std::vector<BranchLog> branches_beside(const std::string& path) {
  const fs::path here(path);
  const fs::path folder = here.has_parent_path() ? here.parent_path() : fs::path(".");
  const std::string first = branch_of(here.filename().string()).first;
  std::map<std::uint64_t, BranchLog> found;
  std::error_code ignored;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, ignored)) {
    const auto [root, number] = branch_of(entry.path().filename().string());
    if (number < 2 || root != first) continue;
    const RunInfo info = info_of(entry.path().string());
    if (info.branch.of.empty()) continue;
    found[number] = {.file = entry.path().filename().string(),
                     .of = info.branch.of,
                     .cycle = info.branch.cycle,
                     .time_ns = static_cast<std::int64_t>(info.branch.cycle) * info.period_ns};
  }
  std::vector<BranchLog> all;
  for (auto& [number, one] : found) all.push_back(std::move(one));
  return all;
}

std::string log_with(const std::string& path, const RunInfo& info, std::uint64_t cycle) {
  return ancestor(path, info, cycle);
}

std::string first_log(const std::string& path, const RunInfo& info) {
  return branch_of(ancestor(path, info, std::nullopt)).first;
}

}  // namespace tandem::log
