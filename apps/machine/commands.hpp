// The commands of `tandem` that say what this machine is fit for. Each prints for people, writes
// JSON when asked, and answers the exit status.
// Layer: apps/machine.  Thread: main.
#pragma once

#include "apps/command_line/command_line.hpp"

namespace tandem::apps {

/// Says what of the machine stands in the way of real time; exit status 0 whatever it finds.
[[nodiscard]] Exit doctor_command(const DoctorOptions& options);
/// Measures; judges nothing.
[[nodiscard]] Exit latency_command(const LatencyOptions& options);

}  // namespace tandem::apps
