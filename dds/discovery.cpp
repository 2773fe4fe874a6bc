// Reads DDS' built-in topics of publications and subscriptions, and gives the names as ROS 2 shows
// them.
#include "dds/discovery.hpp"

#include <algorithm>
#include <array>
#include <cstring>
#include <map>
#include <utility>

namespace tandem::dds {
namespace {

constexpr std::string_view kRosTopic = "rt/";
constexpr std::string_view kRosModule = "::dds_::";

Qos qos_of(const dds_qos_t* from) {
  Qos qos;
  dds_reliability_kind_t reliability{};
  dds_durability_kind_t durability{};
  dds_history_kind_t history{};
  dds_duration_t blocking = 0;
  qos.reliable = dds_qget_reliability(from, &reliability, &blocking) &&
                 reliability == DDS_RELIABILITY_RELIABLE;
  qos.transient_local =
      dds_qget_durability(from, &durability) && durability != DDS_DURABILITY_VOLATILE;
  if (!dds_qget_history(from, &history, &qos.depth) || history == DDS_HISTORY_KEEP_ALL) {
    qos.depth = 0;
  }
  return qos;
}

/// Calls `use` for every endpoint that `reader` knows.
template <class Use>
void each(dds_entity_t reader, const dds_guid_t& but, Use use) {
  constexpr std::size_t kMost = 4096;
  std::vector<void*> samples(kMost, nullptr);
  std::vector<dds_sample_info_t> infos(kMost);
  const dds_return_t count =
      dds_read_mask(reader, samples.data(), infos.data(), kMost, kMost,
                    DDS_ANY_SAMPLE_STATE | DDS_ANY_VIEW_STATE | DDS_ALIVE_INSTANCE_STATE);
  for (dds_return_t i = 0; i < count; ++i) {
    if (!infos[static_cast<std::size_t>(i)].valid_data) continue;
    const auto& endpoint =
        *static_cast<const dds_builtintopic_endpoint_t*>(samples[static_cast<std::size_t>(i)]);
    if (std::memcmp(&endpoint.participant_key, &but, sizeof(but)) != 0) use(endpoint);
  }
  if (count > 0) dds_return_loan(reader, samples.data(), count);
}

}  // namespace

std::string TopicInfo::ros_name() const {
  return topic.starts_with(kRosTopic) ? topic.substr(kRosTopic.size() - 1) : std::string();
}

std::string TopicInfo::ros_type() const {
  const std::size_t module = type.find(kRosModule);
  if (module == std::string::npos || !type.ends_with('_')) return type;
  std::string name = type.substr(0, module) + "/" + type.substr(module + kRosModule.size());
  name.pop_back();
  if (const std::size_t kind = name.find("::"); kind != std::string::npos)
    name.replace(kind, 2, "/");
  return name;
}

Result<Discovery> Discovery::open(const Participant& participant) {
  dds_guid_t self{};
  dds_get_guid(participant.get(), &self);
  Entity writers(
      dds_create_reader(participant.get(), DDS_BUILTIN_TOPIC_DCPSPUBLICATION, nullptr, nullptr));
  if (!writers.ok()) return std::unexpected(dds_error("look for writers", writers.get()));
  Entity readers(
      dds_create_reader(participant.get(), DDS_BUILTIN_TOPIC_DCPSSUBSCRIPTION, nullptr, nullptr));
  if (!readers.ok()) return std::unexpected(dds_error("look for readers", readers.get()));
  return Discovery(self, std::move(writers), std::move(readers));
}

std::vector<TopicInfo> Discovery::topics() const {
  std::map<std::pair<std::string, std::string>, TopicInfo> found;
  const auto of = [&](const dds_builtintopic_endpoint_t& endpoint) -> TopicInfo& {
    TopicInfo& info = found[{endpoint.topic_name, endpoint.type_name}];
    info.topic = endpoint.topic_name;
    info.type = endpoint.type_name;
    return info;
  };
  const auto least = [](TopicInfo& info, const Qos& qos, bool first) {
    if (first) info.qos = qos;
    info.qos.reliable = info.qos.reliable && qos.reliable;
    info.qos.transient_local = info.qos.transient_local && qos.transient_local;
    info.qos.depth = std::min(info.qos.depth, qos.depth);
  };
  each(writers_.get(), self_, [&](const dds_builtintopic_endpoint_t& endpoint) {
    TopicInfo& info = of(endpoint);
    least(info, qos_of(endpoint.qos), info.writers++ == 0);
  });
  each(readers_.get(), self_, [&](const dds_builtintopic_endpoint_t& endpoint) {
    TopicInfo& info = of(endpoint);
    if (info.writers == 0) least(info, qos_of(endpoint.qos), info.readers == 0);
    ++info.readers;
  });
  std::vector<TopicInfo> topics;
  for (auto& [key, info] : found) topics.push_back(std::move(info));
  return topics;
}

}  // namespace tandem::dds
