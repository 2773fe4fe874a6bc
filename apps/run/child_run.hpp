// A run in a process of its own: how it is started, and what became of it.
// Layer: apps/run.  Thread: main.
#pragma once

#include <string>
#include <vector>

#include "apps/command_line/command_line.hpp"
#include "runtime/condition/expectation.hpp"

namespace tandem::apps {

/// What a run in another process came to.
struct ChildRun {
  bool passed = false;  ///< its expectations, of which it has some, and all of its scenario came
  std::vector<runtime::ExpectationResult> expectations{};
  /// How it ended: as `tandem run` says; "crashed", "too slow", "refused" where it cannot.
  std::string ended;
  /// Why it failed beside its expectations: "crashed: SIGSEGV"; empty: it did not.
  std::string reason{};
  double begins_s = 0.0;            ///< not 0: it went on from a state of another run
  std::string said{};               ///< the end of what it printed; empty: it passed
  std::optional<double> limit_s{};  ///< it was too slow for this one
  bool killed = false;  ///< by somebody else, or for want of memory: that need not be its fault
};

/// Reads what it has left: its JSON, and what it printed.
/// @param status  of its process, as wait_for()'s.  @param limit_s  after which it was ended; 0: it
/// ended by itself
[[nodiscard]] ChildRun child_run(const std::string& json_file, const std::string& output_file,
                                 int status, double limit_s);

/// The options of such a run: in simulation, without the wall clock, and beside others: no log, no
/// socket.
[[nodiscard]] RunOptions child_options(const std::string& experiment);

/// The same as words of a command line: run EXPERIMENT --hal sim …
[[nodiscard]] std::vector<std::string> child_words(const std::string& experiment);

}  // namespace tandem::apps
