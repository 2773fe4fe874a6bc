// The other program, `tandem-tools`: its commands need no loop, and the robot's program lacks them.
// Layer: apps/run.  Thread: main.
#pragma once

#include <cstdio>
#include <string>
#include <vector>

#include "apps/text/console.hpp"
#include "base/result.hpp"

namespace tandem::apps {

/// An error that says what to build or install when `tandem-tools` is not beside this program.
[[nodiscard]] Status check_tools();

/// Becomes `tandem-tools` with the same words: standard streams, process and exit status are its.
/// @param words  of the command line, the program's name first
/// @return only if it cannot, after saying why
Exit become_tools(const std::vector<std::string>& words);

/// What `run --report` draws when everything else is over.
struct ReportOfRun {
  std::string log;          ///< empty: nothing
  bool whole = true;        ///< the log has every message
  std::FILE* out = stdout;  ///< where the report is named; null: nowhere
};

/// Becomes `tandem report`, which ends with the run's status: a report that cannot be drawn is no
/// fault of the run. A signal ends it: there is nothing else to do.
/// @return only if it cannot, after saying why
void become_report(const ReportOfRun& report, int status);

}  // namespace tandem::apps
