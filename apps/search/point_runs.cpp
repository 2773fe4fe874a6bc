#include "apps/search/point_runs.hpp"

#include <cmath>
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
  if (result.margin) return *result.margin;
  const bool measured = !result.passed && result.at_s;
  return measured ? -std::numeric_limits<double>::infinity()
                  : std::numeric_limits<double>::quiet_NaN();
}

const runtime::ExpectationResult* least_margin(const ChildRun& run, const std::string& name) {
  const runtime::ExpectationResult* least = nullptr;
  for (const runtime::ExpectationResult& one : run.expectations) {
    if (std::isnan(margin_value(one)) || (!name.empty() && one.name != name)) continue;
    if (least == nullptr || margin_value(one) < margin_value(*least)) least = &one;
  }
  return least;
}

}  // namespace tandem::apps
