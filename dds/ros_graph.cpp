// Keeps the GUIDs of this node's writers and readers, and publishes them whenever one comes or
// goes.
#include "dds/ros_graph.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cstring>

namespace tandem::dds {
namespace {

using Node = rmw_dds_common_msg_dds__NodeEntitiesInfo_;
using Gids = decltype(Node::reader_gid_seq);

constexpr std::size_t kMostCharacters = 255;

bool is_letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; }
bool is_digit(char c) { return c >= '0' && c <= '9'; }

/// The list as a member of a sample: it is the sender's, and stays so.
Gids lent(std::vector<Gid>& gids) {
  const auto size = static_cast<std::uint32_t>(gids.size());
  return {._maximum = size, ._length = size, ._buffer = gids.data(), ._release = false};
}

}  // namespace

bool is_node_name(std::string_view name) {
  return !name.empty() && name.size() <= kMostCharacters && !is_digit(name.front()) &&
         std::ranges::all_of(name, [](char c) { return is_letter(c) || is_digit(c); });
}

Gid gid_of(dds_entity_t entity) {
  dds_guid_t guid{};
  dds_get_guid(entity, &guid);
  Gid gid{};
  static_assert(sizeof(gid.data) == sizeof(guid.v));
  std::memcpy(gid.data, guid.v, sizeof(guid.v));
  return gid;
}

Result<std::unique_ptr<RosGraph>> RosGraph::open(dds_entity_t participant, std::string name_space,
                                                 std::string node) {
  if (!is_node_name(node) || name_space.size() > kMostCharacters) {
    return fail(fmt::format("ROS 2 has no nodes of the name '{}' in '{}'", node, name_space),
                "letters, digits and _, no digit first, at most 255 of them");
  }
  const Qos qos{.reliable = true, .transient_local = true, .depth = 1, .user_data = {}};
  auto writer = RawEndpoint::create(EndpointKind::kWriter, participant,
                                    type<rmw_dds_common::ParticipantEntitiesInfo>(),
                                    "ros_discovery_info", qos);
  if (!writer) return std::unexpected(writer.error());
  return std::unique_ptr<RosGraph>(
      new RosGraph(participant, std::move(name_space), std::move(node), std::move(*writer)));
}

RosGraph::RosGraph(dds_entity_t participant, std::string name_space, std::string node,
                   RawEndpoint writer)
    : participant_(gid_of(participant)),
      name_space_(std::move(name_space)),
      node_(std::move(node)),
      writer_(std::move(writer)) {
  publish();
}

void RosGraph::add(EndpointKind kind, const Gid& gid) {
  const std::lock_guard lock(mutex_);
  (kind == EndpointKind::kWriter ? writers_ : readers_).push_back(gid);
  publish();
}

void RosGraph::remove(EndpointKind kind, const Gid& gid) {
  const std::lock_guard lock(mutex_);
  std::erase_if(kind == EndpointKind::kWriter ? writers_ : readers_,
                [&](const Gid& one) { return std::ranges::equal(one.data, gid.data); });
  publish();
}

void RosGraph::publish() {
  Node node{};
  name_space_.copy(node.node_namespace, kMostCharacters);
  node_.copy(node.node_name, kMostCharacters);
  node.reader_gid_seq = lent(readers_);
  node.writer_gid_seq = lent(writers_);
  const rmw_dds_common::ParticipantEntitiesInfo info{
      .gid = participant_,
      .node_entities_info_seq = {._maximum = 1, ._length = 1, ._buffer = &node, ._release = false}};
  dds_write(writer_.entity.get(), &info);
}

}  // namespace tandem::dds
