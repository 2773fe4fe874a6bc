// [teleoperation]: a loop that is an operator's, with its robot at the other end of a link.
// Layer: apps/run.  Thread: main.
#pragma once

#include <expected>
#include <memory>
#include <string>

#include "base/result.hpp"
#include "runtime/run/composition.hpp"

namespace tandem::runtime {

/// A plugin's path is relative to the experiment's file; its bare name is looked for.
[[nodiscard]] std::string plugin_path(const Experiment& e, const std::string& plugin);

/// With [teleoperation] the backend becomes a TeleBackend before it, with a twin and the robot's
/// own controllers; else nothing happens. Errors: plugins and parameters of
/// [[teleoperation.robot_controller]]; a joint that both ends claim; a twin that cannot be
/// simulated.
[[nodiscard]] Diagnostics put_link_between(Composition& c);

/// A TeleBackend before `robot`, with a twin and the robot's own controllers. Errors as
/// put_link_between()'s. @pre the experiment has [teleoperation]
/// @param warnings  null: told before
[[nodiscard]] std::expected<std::unique_ptr<remote::OperatorEnd>, Diagnostics> link_to(
    const Composition& c, std::unique_ptr<hal::Backend> robot, Diagnostics* warnings = nullptr);

/// [[teleoperation.robot_controller]], for the robot's end; null: there are none.
/// Errors: plugins and parameters; a controller with an input.
/// @param warnings  gets what of theirs is told nowhere; null: told before
[[nodiscard]] std::expected<std::unique_ptr<LocalControllers>, Diagnostics> robot_side_of(
    const Composition& c, Diagnostics* warnings);

/// In real time: the backend becomes a LiveLink to `robot`, with a twin. A robot that stands
/// elsewhere than where the experiment begins is one of the composition's warnings. Errors as
/// put_link_between()'s.
[[nodiscard]] Diagnostics operate_live(Composition& c,
                                       std::unique_ptr<remote::RemoteBackend> robot);

}  // namespace tandem::runtime
