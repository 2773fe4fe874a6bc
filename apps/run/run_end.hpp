// What a run says when it is over.
// Layer: apps.  Thread: non-RT only.
#pragma once

#include <cstdio>
#include <optional>
#include <string>
#include <vector>

#include "apps/run/commands.hpp"
#include "apps/run/run_summary.hpp"

namespace tandem::apps {

/// What is latched, and what the log lost.
[[nodiscard]] std::vector<std::string> fault_texts(const runtime::RobotCycle& cycle,
                                                   const std::optional<log::RecordingResult>& log);

/// Prints the run's table, its warnings and its faults; writes what --trace and --json ask for.
/// @return  how the run ended; a file that cannot be written is an error
[[nodiscard]] Exit tell_end(const RunSummary& summary, const RunOptions& options, std::FILE* out);

}  // namespace tandem::apps
