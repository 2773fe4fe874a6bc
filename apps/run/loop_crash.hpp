// What would end the process in the middle of a cycle, or without a word: an exception, a crash or
// exit().
// Layer: apps/run.  Thread: the loop's, or any where it is said.
#pragma once

#include <chrono>
#include <string>

#include "base/result.hpp"
#include "runtime/heartbeat.hpp"

namespace tandem::apps {

/// What the standard error of a process says whose controller crashes outside of the cycle, between
/// the controller's name and the reason.
inline constexpr char kEarlyCrash[] = ": the controller crashed before its first cycle: ";

/// Keeps the process alive when the loop crashes. Call it on the loop's thread, before its first
/// cycle. An exception, a signal such as SIGSEGV or exit() in the working part of a cycle then
/// stops this thread only, which says why and where, and once the robot is stopped looks for
/// function, file and line, in a child. The watchdog
/// acts at once, as for a loop that hangs: it stops robot and nodes, names the controller and
/// closes the log. The process still ends between two cycles, by _exit(), and by a signal that has
/// another handler already, such as a sanitizer's.
/// @param heartbeat  the loop's; outlives it
void stand_still_on_crash(runtime::Heartbeat& heartbeat);

/// Why it stands still: "segmentation fault (SIGSEGV)", "an exception"; empty: it does not.
[[nodiscard]] const char* crash_reason() noexcept;

/// The watchdog's: what stops the robot has been done. Files and lines are looked for after that.
void robot_is_stopped() noexcept;

/// As long as the place of a crash may take, with what is said of it.
inline constexpr std::chrono::milliseconds kPlaceTime{25'000};
/// Waits until the place of the crash that the loop stands still by is known and said, or known not
/// to be found; for kPlaceTime at most, and until a signal wants the process to stop. On an idle
/// machine it is known long before the loop is given up.
void await_crash_place();

/// The error of a loop that was given up, with what is known of the place by now: at least the
/// library and the offset.
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
