// What others may ask of this process over DDS. The Unix socket is the local operator's: no gate.
// Layer: apps/control.  Thread: any.
#pragma once

#include <functional>
#include <string>

#include "apps/control/control_registry.hpp"
#include "runtime/experiment.hpp"

namespace tandem::apps {

/// Reading and stopping the robot are always let through. What changes something is refused unless
/// `remote.command` allows it; and while somebody owns the robot, what changes controllers,
/// joints and inputs. Loading a controller brings code into this process: it needs `remote.load` as
/// well, and takes names of the trusted folders only, never a path. `studio.open` is refused: its
/// answer has a token.
/// @param owner  who commands the robot from afar, called at each request; empty text: nobody
[[nodiscard]] ControlRegistry::Gate remote_gate(const runtime::RemoteOptions& remote,
                                                std::function<std::string()> owner);

}  // namespace tandem::apps
