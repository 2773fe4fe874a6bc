// What both ends of a service share: a topic for requests and one for replies, as ROS 2 maps
// services. Start at service_server.hpp or service_client.hpp.
// Layer: dds.  Thread: any, non-RT.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "dds/endpoint.hpp"
#include "dds/participant.hpp"

namespace tandem::dds {

/// The first members of every request; the reply to it carries the same.
struct ServiceHeader {
  std::uint64_t guid;     ///< of who asks: any number that no other client of the service has
  std::int64_t sequence;  ///< of theirs
};

/// Whether a generated type begins with the header, as the wire wants it.
template <class T>
concept ServiceSample = requires(T sample) {
  sample.request_guid;
  sample.request_sequence;
  requires offsetof(T, request_guid)
  == offsetof(ServiceHeader, guid);
  requires offsetof(T, request_sequence)
  == offsetof(ServiceHeader, sequence);
};

/// The DDS topics of a ROS 2 service in the participant's namespace: "tandem/ask" is
/// "rq/left/tandem/askRequest" and "rr/left/tandem/askReply". A name that begins with / has its
/// namespace already.
[[nodiscard]] std::string request_topic(const Participant& participant, const std::string& service);
[[nodiscard]] std::string reply_topic(const Participant& participant, const std::string& service);

/// As ROS 2 writes it: "/left/tandem/ask".
[[nodiscard]] std::string full_name(const Participant& participant, const std::string& service);

/// Reliable and volatile, as ROS 2's services are.
/// @param depth       of the history, which is each end's own matter: 10 in ROS 2
/// @param user_data   "clientid=…;": says which reader and writer belong together
[[nodiscard]] Qos service_qos(std::int32_t depth, std::string user_data);

/// A new identity among all services and clients of `participant`, as text.
[[nodiscard]] std::string new_service_id(const Participant& participant);

/// The part of a GUID that all endpoints of a participant have in common.
using ParticipantId = std::array<std::uint8_t, 12>;
[[nodiscard]] ParticipantId id_of(const Participant& participant);
/// "010f5a…": 24 hexadecimal digits.
[[nodiscard]] std::string to_text(const ParticipantId& participant);
/// Reads these digits, between which dots may stand; leaves out what follows. Empty: no such id.
[[nodiscard]] std::optional<ParticipantId> parse_participant(std::string_view text);
/// Who wrote what this reader got by this handle; empty when the writer is gone.
[[nodiscard]] std::optional<ParticipantId> participant_of(dds_entity_t reader,
                                                          dds_instance_handle_t writer);

/// An endpoint of somebody else, or of this process.
struct Peer {
  dds_guid_t participant{}, endpoint{};
  std::string user_data;  ///< "clientid=…;typehash=…;"
};
/// What the reader that `writer` is connected to by this handle says of itself; empty when it is
/// gone. And the other way round.
[[nodiscard]] std::optional<Peer> matched_reader(dds_entity_t writer, dds_instance_handle_t handle);
[[nodiscard]] std::optional<Peer> matched_writer(dds_entity_t reader, dds_instance_handle_t handle);
[[nodiscard]] std::vector<Peer> matched_readers(dds_entity_t writer);
[[nodiscard]] std::vector<Peer> matched_writers(dds_entity_t reader);

/// The value of a key of USER_DATA, "key=value;…"; empty when it is not there.
[[nodiscard]] std::string user_data_value(std::string_view user_data, std::string_view key);

/// Whether two endpoints are one client's (`key` "clientid") or one service's ("serviceid"). Who
/// does not tell is taken by its participant.
[[nodiscard]] bool belong_together(const Peer& one, const Peer& other, std::string_view key);

}  // namespace tandem::dds
