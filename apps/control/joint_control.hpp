// What a running run can be asked for of its joints.
// Layer: apps/control.  Thread: main; the handlers run on the serving thread.
#pragma once

#include "apps/control/control_registry.hpp"
#include "runtime/run_services.hpp"

namespace tandem::apps {

/// Adds "joint.list", "joint.set", "joint.move", "joint.stop", "joint.recover" and "joint.gains".
/// The services outlive the registry.
void add_joint_commands(ControlRegistry& registry, runtime::RunServices& services);

}  // namespace tandem::apps
