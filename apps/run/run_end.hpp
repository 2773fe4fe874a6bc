// What a run says when it is over.
// Layer: apps.  Thread: non-RT only.
#pragma once

#include <cstdio>

#include "apps/run/commands.hpp"
#include "apps/run/run_summary.hpp"

namespace tandem::apps {

/// Prints the run's table, its warnings and its faults, which it adds to `summary`; writes what
/// --trace and --json ask for.
/// @return  how the run ended; a file that cannot be written is an error
[[nodiscard]] Exit tell_end(RunSummary& summary, const RunOptions& options, std::FILE* out);

}  // namespace tandem::apps
