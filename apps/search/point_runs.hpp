// Runs of an experiment at some of its values, in processes of their own.
// Layer: apps/search.  Thread: main.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "apps/run/prepared_study.hpp"
#include "apps/run/run_workers.hpp"
#include "apps/run/trunks.hpp"
#include "base/result.hpp"
#include "base/temporary_folder.hpp"
#include "base/toml_setting.hpp"
#include "sweep/study.hpp"

namespace tandem::apps {

/// A run with other values, and what it came to.
struct PointRun {
  std::vector<TomlSetting> settings;
  ChildRun run{};
};

class PointRuns {
 public:
  /// @param jobs  as RunWorkers'. @param branches  beginnings that points have in common are
  /// simulated once
  PointRuns(const sweep::Study& study, std::size_t jobs, bool branches);

  /// Runs all of them. A stop that was asked for ends it; who called asks for that, too.
  [[nodiscard]] Status run(std::vector<PointRun>& points);
  /// The run of the first point, as it is composed; null: it cannot be run, or there was none yet.
  [[nodiscard]] const runtime::Composition* first() const { return loaded_.world.get(); }
  [[nodiscard]] std::size_t trunks() const { return trunks_.count(); }  ///< that were simulated

 private:
  std::string experiment_;
  TemporaryFolder scratch_{"runs"};
  LoadedRun loaded_;  // by the first point
  LaterKeys later_;
  Trunks trunks_;
  RunWorkers workers_;
  bool is_loaded_ = false;
};

/// The command of such a run, for a shell. @param more  of its flags
[[nodiscard]] std::string command_of_run(const std::string& file,
                                         const std::vector<std::string>& more = {});
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
