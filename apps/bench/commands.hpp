// The commands of `tandem bench`. Each measures this build on this machine.
// Layer: apps/bench.  Thread: main.
#pragma once

#include "apps/command_line/command_line.hpp"

namespace tandem::apps {

/// Multibody engines on the same scenes: writes engines.md with its figures.
[[nodiscard]] Exit bench_command(const BenchOptions& options);

}  // namespace tandem::apps
