// Asks a running process over DDS: the service tandem/ask.
// Layer: apps/clients.  Thread: any, non-RT; one at a time.
#pragma once

#include <memory>

#include "apps/clients/control_client.hpp"
#include "apps/command_line/control_target.hpp"

namespace tandem::apps {

/// Joins the domain and finds the process.
/// Errors: Domain::open()'s; nobody serves there; several do (they are listed).
[[nodiscard]] Result<std::unique_ptr<ControlClient>> open_dds_client(const ControlTarget& target);

}  // namespace tandem::apps
