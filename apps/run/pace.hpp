// At which pace a run goes: what fits its backend, and how it is said.
// Layer: apps/run.  Thread: main.
#pragma once

#include <string>

#include "apps/command_line/command_line.hpp"
#include "apps/run/connection.hpp"
#include "base/result.hpp"

namespace tandem::apps {

/// "in real time", "rate 0.1", "over CAN, in lockstep, free running". @pre it is composed and run
[[nodiscard]] std::string pace_text(const WiredComposition& composition);

/// Boards have clocks of their own, and so has the robot of a server.
[[nodiscard]] Status check_pace(const WiredComposition& composition, const RunOptions& options);

/// Somebody looks at a run with a studio: where no rate is said, a simulated one keeps real time.
void set_pace(const WiredComposition& composition, RunOptions& options);

/// A simulated run is the same to the last bit however late its cycles are: no policy holds.
void note_overrun_policy(const WiredComposition& composition, const RunOptions& options);

}  // namespace tandem::apps
