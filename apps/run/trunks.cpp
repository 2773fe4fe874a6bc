#include "apps/run/trunks.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <string_view>
#include <utility>

#include "base/toml_reader.hpp"
#include "rt/stop_signal.hpp"
#include "runtime/experiment.hpp"

namespace tandem::apps {
namespace {

constexpr std::size_t kEnough = 3;     // runs that want a trunk, which costs a run itself
constexpr std::size_t kMost = 8;       // that are kept: each has its states in memory
constexpr std::size_t kMostTries = 3;  // the values of the first run may be refused

/// "push[0]" of "push[0].impulse_Ns[0]"; empty: no row of what happens.
std::string row_of(std::string_view path) {
  constexpr std::array<std::string_view, 3> kKinds{"push[", "fault[", "event["};
  const bool is_one =
      std::ranges::any_of(kKinds, [path](std::string_view kind) { return path.starts_with(kind); });
  return is_one ? std::string(path.substr(0, path.find(']') + 1)) : std::string();
}

}  // namespace

void Trunks::want(const std::string& common, const RunOptions& options) {
  if (later_.empty()) return;
  auto it = all_.find(common);
  if (it == all_.end()) {
    if (all_.size() == kMost) return;
    it = all_.emplace(common, One{.first = options}).first;
  }
  ++it->second.wanted;
}

Status Trunks::grow(RunWorkers& workers) {
  std::vector<std::pair<One*, std::string>> going;  // and its file
  std::size_t next = 0;
  for (auto& [common, one] : all_) {
    if (one.states != nullptr || one.wanted < kEnough || one.tries == kMostTries) continue;
    going.emplace_back(&one, fmt::format("{}/trunk-{}", workers.folder(), going.size()));
  }
  while ((next < going.size() || !workers.is_empty()) && !rt::stop_requested()) {
    while (next < going.size() && !workers.is_full()) {
      One& one = *going[next].first;
      ++one.tries;
      RunOptions options = one.first;
      options.later = later_;
      options.change = [rows = later_](runtime::Experiment& e) { runtime::put_off(e, rows); };
      options.trunk_file = going[next].second;
      if (Status started = workers.start(next++, std::move(options)); !started) return started;
    }
    auto ended = workers.take_ended();
    if (!ended) return std::unexpected(ended.error());
    for (const EndedRun& run : *ended) {
      auto& [one, file] = going[run.number];
      const std::string& how = run.run.ended;
      auto states = runtime::read_trunk(file);
      (void)::unlink(file.c_str());
      if (how == "crashed" || how == "too slow" || how == "refused" || !states) continue;
      one->states = std::make_shared<const runtime::Trunk>(std::move(*states));
      ++grown_;
    }
  }
  return {};
}

void Trunks::begin_in(const std::string& common, RunOptions& options) const {
  const auto it = all_.find(common);
  if (it == all_.end() || it->second.states == nullptr) return;
  options.later = later_;
  options.trunk = it->second.states;
}

LaterKeys later_keys(const sweep::Study& study) {
  LaterKeys later;
  const auto document = TomlDocument::load(study.experiment);
  if (!document) return later;
  for (const sweep::Vary& one : study.vary) {
    const std::string value = one.values.empty() ? one.at(0.5) : one.values.front();
    const auto set =
        with_settings(document->text(), {{.key = one.key, .value = value, .said = study.file}});
    const std::string row = !set || set->who.empty() ? "" : row_of(set->who.front().first);
    if (row.empty()) continue;
    later.keys.push_back(one.key);
    if (std::ranges::find(later.rows, row) == later.rows.end()) later.rows.push_back(row);
  }
  return later;
}

std::string LaterKeys::common(const std::vector<TomlSetting>& settings) const {
  std::string text;
  for (const TomlSetting& one : settings) {
    if (std::ranges::find(keys, one.key) == keys.end()) text += one.key + "=" + one.value + "\n";
  }
  return text;
}

}  // namespace tandem::apps
