// A controller's library is tried in a process of its own, before a running process opens it: there
// its crash ends nobody.
// Layer: apps/run.  Thread: those that answer requests; the other process' main.
#pragma once

#include <string>

#include "apps/command_line/command_line.hpp"
#include "apps/control/controller_control.hpp"

namespace tandem::apps {

/// How `tandem` starts itself for it: `tandem --try-controller REQUEST`, a flag that no help shows.
inline constexpr char kTryController[] = "--try-controller";

/// For add_run_commands(): starts this program anew, which composes the experiment of `options`
/// without its controllers, opens the library, configures, archives and destroys the controller.
/// Errors: it crashed, called exit(), or took longer than a configure() may; it could not be tried.
/// What configure() refuses is none: it says so again in this process.
[[nodiscard]] TryController try_in_other_process(const RunOptions& options);

/// The other process. @param request  file that try_in_other_process() wrote
/// @return the process' exit status
[[nodiscard]] int try_controller(const std::string& request);

}  // namespace tandem::apps
