// Topic names, quality of service and USER_DATA of a service, and which request writer and reply
// reader belong to the same peer.
#include "dds/service.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <atomic>
#include <charconv>
#include <cstring>
#include <memory>

namespace tandem::dds {
namespace {

std::optional<Peer> to_peer(dds_builtintopic_endpoint_t* endpoint) {
  if (endpoint == nullptr) return std::nullopt;
  const std::unique_ptr<dds_builtintopic_endpoint_t, decltype(&dds_builtintopic_free_endpoint)>
      owned(endpoint, &dds_builtintopic_free_endpoint);
  Peer peer{.participant = endpoint->participant_key, .endpoint = endpoint->key, .user_data = {}};
  void* bytes = nullptr;
  std::size_t size = 0;
  if (endpoint->qos != nullptr && dds_qget_userdata(endpoint->qos, &bytes, &size)) {
    peer.user_data.assign(static_cast<const char*>(bytes), bytes == nullptr ? 0 : size);
    dds_free(bytes);
  }
  return peer;
}

using List = dds_return_t (*)(dds_entity_t, dds_instance_handle_t*, std::size_t);
using Look = std::optional<Peer> (*)(dds_entity_t, dds_instance_handle_t);

/// Who comes or goes meanwhile may be missing.
std::vector<Peer> all_of(dds_entity_t entity, List list, Look look) {
  const dds_return_t count = list(entity, nullptr, 0);
  std::vector<dds_instance_handle_t> handles(static_cast<std::size_t>(std::max(count, 0)));
  const dds_return_t now = list(entity, handles.data(), handles.size());
  handles.resize(std::min(handles.size(), static_cast<std::size_t>(std::max(now, 0))));
  std::vector<Peer> peers;
  for (const dds_instance_handle_t handle : handles) {
    if (auto peer = look(entity, handle)) peers.push_back(std::move(*peer));
  }
  return peers;
}

}  // namespace

std::string full_name(const Participant& participant, const std::string& service) {
  if (service.starts_with('/')) return service;
  const std::string& name_space = participant.config().name_space;
  return name_space.empty() ? "/" + service : "/" + name_space + "/" + service;
}

std::string request_topic(const Participant& participant, const std::string& service) {
  return "rq" + full_name(participant, service) + "Request";
}

std::string reply_topic(const Participant& participant, const std::string& service) {
  return "rr" + full_name(participant, service) + "Reply";
}

Qos service_qos(std::int32_t depth, std::string user_data) {
  Qos qos;
  qos.depth = depth;
  qos.user_data = std::move(user_data);
  return qos;
}

std::string new_service_id(const Participant& participant) {
  static std::atomic<std::uint32_t> last{0};  // no result depends on it
  return fmt::format("{:02x}.{:08x}", fmt::join(id_of(participant), "."), ++last);
}

ParticipantId id_of(const Participant& participant) {
  dds_guid_t guid{};
  dds_get_guid(participant.get(), &guid);
  ParticipantId id{};
  std::copy_n(guid.v, id.size(), id.begin());
  return id;
}

std::string to_text(const ParticipantId& participant) {
  return fmt::format("{:02x}", fmt::join(participant, ""));
}

std::optional<ParticipantId> parse_participant(std::string_view text) {
  std::string digits;
  for (const char c : text) {
    if (c != '.') digits += c;
  }
  ParticipantId id{};
  if (digits.size() < 2 * id.size()) return {};
  for (std::size_t i = 0; i < id.size(); ++i) {
    const char* first = digits.data() + 2 * i;
    if (std::from_chars(first, first + 2, id[i], 16).ptr != first + 2) return {};
  }
  return id;
}

std::optional<ParticipantId> participant_of(dds_entity_t reader, dds_instance_handle_t writer) {
  const std::optional<Peer> peer = matched_writer(reader, writer);
  if (!peer) return {};
  ParticipantId id{};
  std::copy_n(peer->participant.v, id.size(), id.begin());
  return id;
}

std::optional<Peer> matched_reader(dds_entity_t writer, dds_instance_handle_t handle) {
  return to_peer(dds_get_matched_subscription_data(writer, handle));
}

std::optional<Peer> matched_writer(dds_entity_t reader, dds_instance_handle_t handle) {
  return to_peer(dds_get_matched_publication_data(reader, handle));
}

std::vector<Peer> matched_readers(dds_entity_t writer) {
  return all_of(writer, &dds_get_matched_subscriptions, &matched_reader);
}

std::vector<Peer> matched_writers(dds_entity_t reader) {
  return all_of(reader, &dds_get_matched_publications, &matched_writer);
}

std::string user_data_value(std::string_view user_data, std::string_view key) {
  while (!user_data.empty()) {
    const std::string_view entry = user_data.substr(0, user_data.find(';'));
    const std::size_t equals = entry.find('=');
    if (equals != std::string_view::npos && entry.substr(0, equals) == key) {
      return std::string(entry.substr(equals + 1));
    }
    user_data.remove_prefix(std::min(entry.size() + 1, user_data.size()));
  }
  return {};
}

bool belong_together(const Peer& one, const Peer& other, std::string_view key) {
  const std::string id = user_data_value(one.user_data, key);
  const std::string other_id = user_data_value(other.user_data, key);
  if (!id.empty() || !other_id.empty()) return id == other_id;
  return std::memcmp(&one.participant, &other.participant, sizeof one.participant) == 0;
}

}  // namespace tandem::dds
