// One DDS participant per process, with its node in the ROS graph and the namespace of its topics.
#include "dds/participant.hpp"

#include <fmt/core.h>

#include <string_view>

namespace tandem::dds {

Result<std::unique_ptr<Participant>> Participant::open(std::shared_ptr<Domain> domain,
                                                       std::string node) {
  constexpr std::string_view kEnclave = "enclave=/;";  // as every ROS 2 participant says
  const std::unique_ptr<dds_qos_t, decltype(&dds_delete_qos)> qos(dds_create_qos(),
                                                                  &dds_delete_qos);
  dds_qset_userdata(qos.get(), kEnclave.data(), kEnclave.size());
  const int number = domain->config().domain;
  Entity entity(dds_create_participant(static_cast<dds_domainid_t>(number), qos.get(), nullptr));
  if (!entity.ok()) {
    return std::unexpected(dds_error(fmt::format("take part in the DDS domain {}", number),
                                     entity.get(), "are too many processes in it?"));
  }
  auto graph = RosGraph::open(entity.get(), "/" + domain->config().name_space, node);
  if (!graph) return std::unexpected(graph.error());
  return std::unique_ptr<Participant>(
      new Participant(std::move(domain), std::move(node), std::move(entity), std::move(*graph)));
}

Participant::Participant(std::shared_ptr<Domain> domain, std::string node, Entity entity,
                         std::unique_ptr<RosGraph> graph)
    : domain_(std::move(domain)),
      node_(std::move(node)),
      entity_(std::move(entity)),
      graph_(std::move(graph)) {}

}  // namespace tandem::dds
