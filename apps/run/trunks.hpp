// The beginnings that runs have in common which differ only in what happens later, each simulated
// once, by a process of its own.
// Layer: apps/run.  Thread: main.
#pragma once

#include <cstddef>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "apps/run/run_workers.hpp"
#include "runtime/run/trunk.hpp"
#include "sweep/study.hpp"

namespace tandem::apps {

/// ```
/// for (each run) trunks.want(what it has in common with others, its options);
/// trunks.grow(workers);
/// for (each run) { trunks.begin_in(common, options); workers.start(number, options); }
/// ```
/// A run that begins in a trunk comes to the same, to the last bit.
class Trunks {
 public:
  /// @param later  rows of the experiment, such as "push[0]", in which the runs differ; empty:
  /// every run begins at its beginning
  explicit Trunks(std::vector<std::string> later = {}) : later_(std::move(later)) {}

  /// A run that is to come. @param common  all that it has in common with others
  void want(const std::string& common, const RunOptions& options);
  /// Simulates those that enough runs want. Where one cannot be, they begin at their beginning.
  /// Errors: RunWorkers'. @pre no worker goes on
  [[nodiscard]] Status grow(RunWorkers& workers);
  /// Lets a run begin in its trunk, if there is one.
  void begin_in(const std::string& common, RunOptions& options) const;
  [[nodiscard]] std::size_t count() const { return grown_; }  ///< that were simulated

 private:
  struct One {
    RunOptions first;  // of the runs that want it
    std::size_t wanted = 0, tries = 0;
    std::shared_ptr<const runtime::Trunk> states{};
  };
  std::vector<std::string> later_;
  std::map<std::string, One> all_;
  std::size_t grown_ = 0;
};

/// What of a study's points is about rows of what happens.
struct LaterKeys {
  std::vector<std::string> rows;  ///< "push[0]"
  std::vector<std::string> keys;  ///< of the study's [[vary]] that are of these rows
  /// All of a run's settings that are of none of them.
  [[nodiscard]] std::string common(const std::vector<TomlSetting>& settings) const;
};
[[nodiscard]] LaterKeys later_keys(const sweep::Study& study);

}  // namespace tandem::apps
