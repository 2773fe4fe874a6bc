// A raw endpoint that is listed in the ROS graph for as long as it lives.
#include "dds/endpoint.hpp"

namespace tandem::dds {

Endpoint::Endpoint(Kind kind, std::string topic, RawEndpoint raw, RosGraph& graph)
    : kind_(kind),
      topic_(std::move(topic)),
      raw_(std::move(raw)),
      entry_(graph, kind, raw_.entity.get()) {}

Result<Endpoint> Endpoint::create(Kind kind, Participant& participant, const Type& type,
                                  const std::string& topic, const Qos& qos, const MakeTopic& make) {
  auto raw = RawEndpoint::create(kind, participant.get(), type, topic, qos, make);
  if (!raw) return std::unexpected(raw.error());
  return Endpoint(kind, topic, std::move(*raw), participant.graph());
}

std::uint32_t Endpoint::matched() const {
  if (kind_ == Kind::kWriter) {
    dds_publication_matched_status_t status{};
    dds_get_publication_matched_status(get(), &status);
    return status.current_count;
  }
  dds_subscription_matched_status_t status{};
  dds_get_subscription_matched_status(get(), &status);
  return status.current_count;
}

}  // namespace tandem::dds
