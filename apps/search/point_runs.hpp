// Runs of an experiment at some of its values, in processes of their own.
// Layer: apps/search.  Thread: main.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "apps/search/child_runs.hpp"
#include "base/result.hpp"
#include "base/toml_setting.hpp"

namespace tandem::apps {

/// A run with other values, and what it came to.
struct PointRun {
  std::vector<TomlSetting> settings;
  ChildRun run{};
};

class PointRuns {
 public:
  /// As ChildRuns.
  PointRuns(std::string experiment, std::size_t jobs, double timeout_s)
      : experiment_(std::move(experiment)), runs_(jobs, timeout_s) {}

  /// Runs all of them. A stop that was asked for ends it; who called asks for that, too.
  [[nodiscard]] Status run(std::vector<PointRun>& points);

 private:
  std::string experiment_;
  ChildRuns runs_;
};

/// As words of a command line: --set KEY=VALUE.
[[nodiscard]] std::vector<std::string> flags_of(const std::vector<TomlSetting>& settings);

/// What a search minimises: the margin. Without one minus infinity where it failed, as by a fall,
/// and infinity where it passed.
[[nodiscard]] double margin_value(const runtime::ExpectationResult& result);
/// The result of an expectation, or of that with the least margin_value(). A run that crashed, took
/// too long, or ended by a fault that none awaits failed without a margin. Empty: it could not be
/// run, or has no such expectation.
/// @param name  empty: any
[[nodiscard]] std::optional<runtime::ExpectationResult> least_margin(const ChildRun& run,
                                                                     const std::string& name);

}  // namespace tandem::apps
