// Whether scenarios fail as a first one did: each is run, in a process of its own, a few at once.
// Layer: apps/search.  Thread: main.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "apps/run/prepared_study.hpp"
#include "apps/run/run_workers.hpp"
#include "apps/run/trunks.hpp"
#include "base/result.hpp"
#include "base/temporary_folder.hpp"
#include "runtime/condition/expectation.hpp"

namespace tandem::apps {

/// How a run failed: what else fails in the same way is the same failure.
struct Failure {
  runtime::ExpectationResult expectation;
  std::string ended;  ///< as ChildRun's

  /// Whether a run failed by the same expectation, for the same reason but for its figures. What
  /// was not measured in one of both, such as a window that was never reached, is another failure.
  [[nodiscard]] bool is_of(const ChildRun& run) const;
};
/// The result of this name; null: it has none.
[[nodiscard]] const runtime::ExpectationResult* result_named(const ChildRun& run,
                                                             const std::string& name);

/// Runs texts of experiments.
class JudgedScenarios {
 public:
  /// @param file  of the scenario: names in the texts are relative to it
  /// @param branches  beginnings that they have in common are simulated once
  JudgedScenarios(std::string file, std::size_t jobs, double timeout_s, bool branches);

  /// Runs all of them; in their order. A stop that was asked for ends it: fewer.
  [[nodiscard]] Result<std::vector<ChildRun>> run(const std::vector<std::string>& texts);
  /// Runs them until it is known which is the first, in their order, that fails so. A later one
  /// may run, too, and is not heard: the answer does not depend on how many run at once.
  /// @return which, and its run; empty: none, or a stop was asked for
  [[nodiscard]] Result<std::optional<EndedRun>> first_failing(const std::vector<std::string>& texts,
                                                              const Failure& failure);

  [[nodiscard]] std::size_t runs() const { return started_; }       ///< that were started
  [[nodiscard]] std::size_t branched() const { return branched_; }  ///< of those that have ended
  [[nodiscard]] std::size_t trunks() const { return trunks_.count(); }

 private:
  using Wanted = std::function<bool(const ChildRun&)>;
  /// @param wanted  where it holds, those behind it are ended.  @return the runs by their number
  [[nodiscard]] Result<std::vector<std::optional<ChildRun>>> run_until(
      const std::vector<std::string>& texts, const Wanted& wanted);

  /// Each in a file of its own, and what it has in common with others.
  [[nodiscard]] Status write_down(const std::vector<std::string>& texts,
                                  std::vector<RunOptions>& options,
                                  std::vector<std::string>& common);

  std::string file_;
  TemporaryFolder scratch_{"runs"};
  LoadedRun loaded_;  // as it is
  Trunks trunks_;
  RunWorkers workers_;
  bool is_loaded_ = false;
  std::size_t written_ = 0, started_ = 0, branched_ = 0;
};

}  // namespace tandem::apps
