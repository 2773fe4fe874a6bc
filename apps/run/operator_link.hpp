// [teleoperation]: a loop that is an operator's, with its robot at the other end of a link.
// Layer: apps/run.  Thread: main.
#pragma once

#include <string>

#include "apps/run/composition.hpp"
#include "base/result.hpp"

namespace tandem::apps {

/// A plugin's path is relative to the experiment's file; its bare name is looked for.
[[nodiscard]] std::string plugin_path(const runtime::Experiment& e, const std::string& plugin);

/// With [teleoperation] the backend becomes a TeleBackend before it, with a twin and the robot's
/// own controllers; else nothing happens. Errors: plugins and parameters of
/// [[teleoperation.robot_controller]]; a joint that both ends claim; a twin that cannot be
/// simulated.
[[nodiscard]] Diagnostics put_link_between(Composition& c);

}  // namespace tandem::apps
