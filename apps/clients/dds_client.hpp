// Asks a running process over DDS: the service tandem/ask; and has a participant admitted there.
// Layer: apps/clients.  Thread: any, non-RT; one at a time.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "apps/clients/control_client.hpp"
#include "apps/command_line/control_target.hpp"
#include "dds/participant.hpp"

namespace tandem::apps {

/// Joins the domain and finds the process.
/// Errors: Domain::open()'s; nobody serves there; several do (they are listed).
[[nodiscard]] Result<std::unique_ptr<ControlClient>> open_dds_client(const ControlTarget& target);

/// One process' answer to a question that every one of them was asked.
struct DdsAnswer {
  std::string who;  ///< "tandem_run in the namespace 'left' (process 17566)"
  Result<Json> answer;
};
/// Asks every process of the domain, and of the namespace when one is named, at once. It is for
/// stops: this participant is not admitted first.
/// @return an answer, or the error, of each. Errors: Domain::open()'s; nobody serves there.
[[nodiscard]] Result<std::vector<DdsAnswer>> ask_all_over_dds(const ControlTarget& target,
                                                              const Json& question);

/// Has this participant admitted by every process of this user on this machine; those that are not
/// on DDS, or do not answer, are passed over.
void have_admitted(const dds::Participant& participant);

}  // namespace tandem::apps
