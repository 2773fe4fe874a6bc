// Asks a running process over DDS: the service tandem/ask; and has a participant admitted there.
// Layer: apps/clients.  Thread: any, non-RT; one at a time.
#pragma once

#include <memory>

#include "apps/clients/control_client.hpp"
#include "apps/command_line/control_target.hpp"
#include "dds/participant.hpp"

namespace tandem::apps {

/// Joins the domain and finds the process.
/// Errors: Domain::open()'s; nobody serves there; several do (they are listed).
[[nodiscard]] Result<std::unique_ptr<ControlClient>> open_dds_client(const ControlTarget& target);

/// Has this participant admitted by every process of this user on this machine; those that are not
/// on DDS, or do not answer, are passed over.
void have_admitted(const dds::Participant& participant);

}  // namespace tandem::apps
