// What would end the process in the middle of a cycle: an exception, a crash or exit().
// Layer: apps/run.  Thread: the loop's.
#pragma once

#include "runtime/heartbeat.hpp"

namespace tandem::apps {

/// Call it on the loop's thread, before the first cycle. While the loop is at work, an exception, a
/// signal such as SIGSEGV and a call of exit() then no longer end the process: the thread says why,
/// and stands still. The watchdog does the rest at once, as for a loop that hangs: it stops robot
/// and nodes, names the controller and closes the log. Between two cycles the process ends as
/// usual. It also ends by _exit(), and by a signal that a sanitizer, say, handles already.
/// @param heartbeat  the loop's; outlives it
void stand_still_on_crash(runtime::Heartbeat& heartbeat);

}  // namespace tandem::apps
