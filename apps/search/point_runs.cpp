#include "apps/search/point_runs.hpp"

#include <fmt/format.h>

#include <limits>
#include <utility>

#include "apps/search/commands.hpp"
#include "base/counted.hpp"
#include "base/quoting.hpp"
#include "rt/stop_signal.hpp"

namespace tandem::apps {

PointRuns::PointRuns(const sweep::Study& study, std::size_t jobs, bool branches)
    : experiment_(study.experiment),
      later_(branches ? later_keys(study) : LaterKeys()),
      trunks_(later_.rows),
      workers_(scratch_.below("work"), jobs, study.time_limit_s) {}

Status PointRuns::run(std::vector<PointRun>& points) {
  if (Status made = scratch_.made(); !made) return made;
  std::vector<RunOptions> all;
  std::vector<std::string> common;
  for (const PointRun& point : points) {
    all.push_back(child_options(experiment_));
    all.back().settings = point.settings;
    common.push_back(later_.common(point.settings));
  }
  if (!all.empty() && !std::exchange(is_loaded_, true)) {
    loaded_ = load_run(all.front());
    if (loaded_.world != nullptr) workers_.read_instead(loaded_.texts);
  }
  for (std::size_t i = 0; i < all.size(); ++i) trunks_.want(common[i], all[i]);
  if (Status grown = trunks_.grow(workers_); !grown) return grown;
  std::size_t next = 0;
  while ((next < all.size() || !workers_.is_empty()) && !rt::stop_requested()) {
    while (next < all.size() && !workers_.is_full()) {
      trunks_.begin_in(common[next], all[next]);
      if (Status started = workers_.start(next, all[next]); !started) return started;
      ++next;
    }
    auto ended = workers_.take_ended();
    if (!ended) return std::unexpected(ended.error());
    for (EndedRun& one : *ended) points[one.number].run = std::move(one.run);
  }
  workers_.end_all();
  return {};
}

std::string command_of_run(const std::string& file, const std::vector<std::string>& more) {
  std::string command = "tandem";
  std::vector<std::string> words = child_words(file);
  words.insert(words.end(), more.begin(), more.end());
  for (const std::string& word : words) command += " " + shell_word(word);
  return command;
}

std::vector<std::string> flags_of(const std::vector<TomlSetting>& settings) {
  std::vector<std::string> flags;
  for (const TomlSetting& one : settings) {
    flags.emplace_back("--set");
    flags.push_back(one.key + "=" + one.value);
  }
  return flags;
}

std::string branches_text(std::size_t branched, std::size_t trunks) {
  return fmt::format("{} of them went on from {}, simulated once", branched,
                     counted(trunks, "common beginning"));
}

double margin_value(const runtime::ExpectationResult& result) {
  constexpr double kNone = std::numeric_limits<double>::infinity();
  return result.margin.value_or(result.passed ? kNone : -kNone);
}

std::optional<runtime::ExpectationResult> least_margin(const ChildRun& run,
                                                       const std::string& name) {
  if (run.ended == "refused" || run.killed) return std::nullopt;
  std::optional<runtime::ExpectationResult> least;
  for (const runtime::ExpectationResult& one : run.expectations) {
    if (!name.empty() && one.name != name) continue;
    if (!least || margin_value(one) < margin_value(*least)) least = one;
  }
  const bool ended_badly = run.ended == "crashed" || run.ended == "too slow";
  const bool by_a_fault = run.ended == "by a fault" && !run.reason.empty();  // none awaits it
  if (ended_badly || (least && by_a_fault)) {
    least = runtime::ExpectationResult{
        .name = name.empty() ? "the run" : name, .unit = {}, .reason = run.reason};
  }
  return least;
}

}  // namespace tandem::apps
