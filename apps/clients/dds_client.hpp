// Asks a running process over DDS: the service tandem/ask; and has a participant admitted there.
// Layer: apps/clients.  Thread: any, non-RT; one at a time.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "apps/clients/control_client.hpp"
#include "apps/command_line/control_target.hpp"
#include "dds/participant.hpp"
#include "dds/service.hpp"

namespace tandem::apps {

/// Joins the domain and finds the process.
/// Errors: Domain::open()'s; nobody serves there; several do (they are listed).
[[nodiscard]] Result<std::unique_ptr<ControlClient>> open_dds_client(const ControlTarget& target);

/// One process' answer to a question that every one of them was asked.
struct DdsAnswer {
  std::string who;  ///< "tandem_run in the namespace 'left' (process 17566)", as they say
  Result<Json> answer;
  std::optional<dds::ParticipantId> participant{};  ///< whose answer it is; empty: there is none
};
struct DdsAnswers {
  bool secured = false;  ///< DDS Security has authenticated whoever answered
  std::vector<DdsAnswer> all{};
};
/// Asks every process of the domain, and of the namespace when one is named, at once for a stop, by
/// tandem/stop: this participant is not admitted first.
/// @return an answer, or the error, of each. Errors: Domain::open()'s; nobody serves there.
[[nodiscard]] Result<DdsAnswers> stop_all_by_dds(const ControlTarget& target, const Json& question);

/// A run of this user on this machine that is on DDS, as its control socket says: nobody else can
/// serve that.
struct OwnRun {
  std::string who;  ///< process_of()
  dds::ParticipantId participant{};
  int domain = 0;
  std::string name_space{};
};
struct OwnRuns {
  std::vector<OwnRun> runs{};
  std::vector<std::string> silent{};  ///< that did not answer within kStopAnswer
};
/// Asks all of them at once.
[[nodiscard]] OwnRuns own_runs_on_dds();

/// Has this participant admitted by every process of this user on this machine; those that are not
/// on DDS, or do not answer, are passed over.
void have_admitted(const dds::Participant& participant);

}  // namespace tandem::apps
