// What a running run can be asked for of its sensors.
// Layer: apps/control.  Thread: main; the handlers run on the serving thread.
#pragma once

#include "apps/control/control_registry.hpp"
#include "runtime/run_services.hpp"

namespace tandem::apps {

/// Adds "sensor.list". The services outlive the registry.
void add_sensor_commands(ControlRegistry& registry, const runtime::RunServices& services);

}  // namespace tandem::apps
