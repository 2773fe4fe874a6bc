// What would end the process in the middle of a cycle, or without a word: an exception, a crash or
// exit().
// Layer: apps/run.  Thread: the loop's, or any where it is said.
#pragma once

#include <string>

#include "base/result.hpp"
#include "runtime/heartbeat.hpp"

namespace tandem::apps {

/// Keeps the process alive when the loop crashes. Call it on the loop's thread, before its first
/// cycle. An exception, a signal such as SIGSEGV or exit() in the working part of a cycle then
/// stops this thread only, which says why, and where with function, file and line. The watchdog
/// acts at once, as for a loop that hangs: it stops robot and nodes, names the controller and
/// closes the log. The process still ends between two cycles, by _exit(), and by a signal that has
/// another handler already, such as a sanitizer's.
/// @param heartbeat  the loop's; outlives it
void stand_still_on_crash(runtime::Heartbeat& heartbeat);

/// Why it stands still: "segmentation fault (SIGSEGV)", "an exception"; empty: it does not.
[[nodiscard]] const char* crash_reason() noexcept;

/// Where in its author's code a controller crashed. Without debug information function and file may
/// be empty, and the line 0.
struct CrashPlace {
  std::string function, file;
  int line = 0;
  /// " in FUNCTION", or empty.
  [[nodiscard]] std::string in_function() const;
};

/// The place of the crash that the loop stands still by; waits up to 1.5 s
/// until it is found out; else empty.
[[nodiscard]] CrashPlace crash_place();

/// The error of a loop that was given up.
/// @param fault  what CycleGuard says of it
[[nodiscard]] Error loop_error(const std::string& fault);

/// The process ends by SIGSEGV and the like as it did, but names the controller in whose code that
/// happens outside of the cycle, as in configure(), and writes the command's JSON, with the place.
/// Any thread's.
void name_crashing_controllers();

/// As a return from main(), but at once where a controller was given up that did not return, or
/// called exit(): what that uses must stay, and a second exit() would wait for the first.
/// @return status
[[nodiscard]] int end_beside_controllers(int status);

}  // namespace tandem::apps
