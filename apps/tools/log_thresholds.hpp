// Collision thresholds learned from a log of free motion.
// Layer: apps/tools.  Thread: main.
#pragma once

#include "apps/command_line/command_line.hpp"
#include "base/result.hpp"
#include "log/log_file.hpp"

namespace tandem::apps {

/// Prints [estimation.collision] as an experiment takes it, or JSON.
/// What was before the bring-up, and after the controllers' end or the first fault, is left out.
/// Errors: a log without external torques; less than 8 s of them; numbers that are not finite.
[[nodiscard]] Status print_thresholds(const log::LogFile& file, const LogOptions& options);

}  // namespace tandem::apps
