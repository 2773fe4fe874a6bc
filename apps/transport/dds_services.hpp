// What a running process can be asked for, as ROS 2 services: docs/ros2.md.
// Layer: apps/transport.  Thread: open and close main; answers on the services' own threads.
#pragma once

#include <memory>

#include "apps/control/control_registry.hpp"
#include "apps/control/typed_service.hpp"
#include "apps/transport/dds_admission.hpp"
#include "base/result.hpp"
#include "dds/service_server.hpp"

namespace tandem::apps {

/// Serves a registry as "tandem/ask"; by the rows of typed_service.hpp, "tandem/list_controllers"
/// and so on; and as "tandem_run/set_parameters" and the other five by which ROS 2 reads and sets a
/// node's parameters. Every typed request becomes a question to the
/// registry. Stops have services, readers and a thread of their own, "tandem/stop" and
/// "tandem/emergency_stop": what others ask for, and how much of it, does not delay them. Of who is
/// not admitted kMaxStrangersQuestion bytes are read.
class DdsServices {
 public:
  /// Participant, registry and admission outlive it; the registry is complete.
  /// Errors: Endpoint::create()'s.
  [[nodiscard]] static Result<std::unique_ptr<DdsServices>> open(dds::Participant& participant,
                                                                 const ControlRegistry& registry,
                                                                 ControlRegistry::Gate gate,
                                                                 const DdsAdmission& admission);

  [[nodiscard]] dds::ServiceServer::Counts counts() const;

 private:
  DdsServices(const ControlRegistry& registry, ControlRegistry::Gate gate,
              const DdsAdmission& admission)
      : registry_(&registry), gate_(std::move(gate)), admission_(&admission) {}
  Status add_all();
  Status add_ask(dds::ServiceServer& server, const char* name, bool only_stops);
  Status add(const TypedService& row);
  Status add_parameters();
  template <class Request, class Response>
  Status add_parameters(const char* name);
  /// @param after_stop  ControlRegistry::last_stop() when the question came
  [[nodiscard]] Json ask(const std::string& question, const dds::Asker& asker,
                         std::uint64_t after_stop) const;

  const ControlRegistry* registry_;
  ControlRegistry::Gate gate_;
  const DdsAdmission* admission_;
  std::string node_;
  std::unique_ptr<dds::ServiceServer> stops_, server_;  // last: their threads use the others
};

}  // namespace tandem::apps
