// Collision thresholds learned from logs of free motion, and tried on others.
// Layer: apps/tools.  Thread: main.
#pragma once

#include "apps/command_line/command_line.hpp"
#include "base/result.hpp"

namespace tandem::apps {

/// Prints [estimation.collision] as an experiment takes it, or JSON. With `against` also how often
/// those runs' free motion passes the thresholds and when their pushes do, for factors on them;
/// with `output` that as a page with figures.
/// What was before the bring-up, and after the controllers' end, the first fault or the first
/// injected push, is not learned from.
/// Errors: a log without external torques, with less than 8 s of free motion; numbers that are not
/// finite; logs of different robots, descriptions or bandwidths of the observer; a page that is
/// there and is another's.
[[nodiscard]] Status print_thresholds(const LogOptions& options);

}  // namespace tandem::apps
