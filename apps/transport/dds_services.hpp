// What a running process can be asked for, as ROS 2 services: docs/ros2.md.
// Layer: apps/transport.  Thread: open and close main; answers on the services' own threads.
#pragma once

#include <memory>

#include "apps/control/control_registry.hpp"
#include "apps/transport/dds_admission.hpp"
#include "base/result.hpp"
#include "dds/service_server.hpp"

namespace tandem::apps {

/// Serves a registry as "tandem/ask", and those of its commands that have a type of their own:
/// "tandem/list_controllers" and so on. Every typed request becomes a question to the registry.
class DdsServices {
 public:
  /// Participant, registry and admission outlive it; the registry is complete.
  /// Errors: Endpoint::create()'s.
  [[nodiscard]] static Result<std::unique_ptr<DdsServices>> open(dds::Participant& participant,
                                                                 const ControlRegistry& registry,
                                                                 ControlRegistry::Gate gate,
                                                                 const DdsAdmission& admission);

  [[nodiscard]] dds::ServiceServer::Counts counts() const { return server_->counts(); }

 private:
  DdsServices(const ControlRegistry& registry, ControlRegistry::Gate gate,
              const DdsAdmission& admission)
      : registry_(&registry), gate_(std::move(gate)), admission_(&admission) {}
  Status add_all();
  Status add_ask();
  /// Adds a service that asks for a command, when the registry has `needs`.
  template <class Request, class Response>
  Status add(const char* name, const char* needs, Json (*question)(const Request&),
             void (*fill)(const Json& answer, Response& reply, dds::ReplyMemory& memory));
  [[nodiscard]] Json ask(const std::string& question, const dds::Asker& asker) const;

  const ControlRegistry* registry_;
  ControlRegistry::Gate gate_;
  const DdsAdmission* admission_;
  std::unique_ptr<dds::ServiceServer> server_;  // last: its threads use the others
};

}  // namespace tandem::apps
