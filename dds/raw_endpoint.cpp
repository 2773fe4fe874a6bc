// Quality of service and USER_DATA (type hash) of a Cyclone DDS writer or reader.
#include "dds/raw_endpoint.hpp"

#include <memory>

#include "dds/cyclone_inside.hpp"

namespace tandem::dds {
namespace {

using QosPointer = std::unique_ptr<dds_qos_t, decltype(&dds_delete_qos)>;

QosPointer to_dds(const Qos& qos, const Type& type) {
  QosPointer out(dds_create_qos(), &dds_delete_qos);
  const dds_data_representation_id_t plain = DDS_DATA_REPRESENTATION_XCDR1;
  dds_qset_data_representation(out.get(), 1, &plain);
  // A writer never waits: what a slow reader has no room for is not sent, and said so.
  dds_qset_reliability(out.get(),
                       qos.reliable ? DDS_RELIABILITY_RELIABLE : DDS_RELIABILITY_BEST_EFFORT, 0);
  dds_qset_durability(
      out.get(), qos.transient_local ? DDS_DURABILITY_TRANSIENT_LOCAL : DDS_DURABILITY_VOLATILE);
  dds_qset_history(out.get(), DDS_HISTORY_KEEP_LAST, qos.depth);
  if (qos.transient_local) {
    dds_qset_durability_service(out.get(), 0, DDS_HISTORY_KEEP_LAST, qos.depth, -1, -1, -1);
  }
  const std::string user_data = qos.user_data + "typehash=" + type.hash + ";";
  dds_qset_userdata(out.get(), user_data.data(), user_data.size());
  return out;
}

}  // namespace

dds_entity_t make_topic(dds_entity_t participant, const Type& type, const char* name) {
  // Without settings: they are the endpoint's, and may be others for the next one of this topic.
  return dds_create_topic(participant, type.descriptor, name, nullptr, nullptr);
}

Result<RawEndpoint> RawEndpoint::create(EndpointKind kind, dds_entity_t participant,
                                        const Type& type, const std::string& topic, const Qos& qos,
                                        const MakeTopic& make) {
  const QosPointer settings = to_dds(qos, type);
  Entity made(make(participant, type, topic.c_str()));
  if (!made.ok()) {
    return std::unexpected(
        dds_error("make the topic " + topic + " of type " + type.ros_name, made.get()));
  }
  const bool writes = kind == EndpointKind::kWriter;
  Entity end(writes ? dds_create_writer(participant, made.get(), settings.get(), nullptr)
                    : dds_create_reader(participant, made.get(), settings.get(), nullptr));
  if (!end.ok()) {
    return std::unexpected(dds_error(
        std::string("make a ") + (writes ? "writer" : "reader") + " of " + topic, end.get()));
  }
  if (!writes && qos.reliable) tandem_dds_hear_from_first(end.get());
  return RawEndpoint{.topic = std::move(made), .entity = std::move(end)};
}

}  // namespace tandem::dds
