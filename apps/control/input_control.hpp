// What a running run can be asked for of its controllers' inputs.
// Layer: apps/control.  Thread: main; the handlers run on the serving thread.
#pragma once

#include "apps/control/control_registry.hpp"
#include "runtime/run_services.hpp"

namespace tandem::apps {

/// Adds "input.list" and "input.set". The services outlive the registry.
void add_input_commands(ControlRegistry& registry, runtime::RunServices& services);

}  // namespace tandem::apps
