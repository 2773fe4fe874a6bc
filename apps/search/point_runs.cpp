#include "apps/search/point_runs.hpp"

#include <limits>
#include <utility>

#include "rt/stop_signal.hpp"

namespace tandem::apps {

Status PointRuns::run(std::vector<PointRun>& points) {
  std::size_t next = 0;
  while ((next < points.size() || !runs_.is_empty()) && !rt::stop_requested()) {
    while (next < points.size() && !runs_.is_full()) {
      std::vector<std::string> words = child_words(experiment_);
      for (std::string& flag : flags_of(points[next].settings)) words.push_back(std::move(flag));
      if (Status started = runs_.start(next++, std::move(words)); !started) return started;
    }
    for (EndedRun& one : runs_.take_ended()) points[one.number].run = std::move(one.run);
  }
  runs_.end_all();
  return {};
}

std::vector<std::string> flags_of(const std::vector<TomlSetting>& settings) {
  std::vector<std::string> flags;
  for (const TomlSetting& one : settings) {
    flags.emplace_back("--set");
    flags.push_back(one.key + "=" + one.value);
  }
  return flags;
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
