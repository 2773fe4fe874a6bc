// What would end the process in the middle of a cycle: an exception, a crash or exit().
// Layer: apps/run.  Thread: the loop's.
#pragma once

#include "runtime/heartbeat.hpp"

namespace tandem::apps {

/// To be called on the loop's thread, before its first cycle. From then on that thread stands still
/// where an exception, a signal such as SIGSEGV or a call of exit() would have ended the process
/// while the loop is at work, and says why. What follows is the watchdog's, as for a loop that
/// hangs: emergency stop, NMT stop, the controller's name, a log that is whole. Elsewhere the
/// process ends as usual. So it does by _exit(), and by a signal that something else, such as a
/// sanitizer, handles already.
/// @param heartbeat  the loop's; outlives it
void stand_still_on_crash(const runtime::Heartbeat& heartbeat);

}  // namespace tandem::apps
