// Both layouts in which ROS 2's middlewares send requests and replies, at one topic.
//
// Cyclone DDS's: 16 bytes in front of the members say who asked, and the request's number. Fast
// DDS's: the members alone; a reply's inline QoS names the request. A sample has the 16 bytes here
// in either case. What this needs of Cyclone DDS is only in service_layout.cpp.
// Layer: dds.  Thread: any, non-RT.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "dds/types.hpp"

struct ddsi_serdata;
struct ddsi_sertype;

namespace tandem::dds {

/// What a reply has to repeat for a client of Fast DDS.
struct FastCall {
  std::array<std::uint8_t, 16> client{};  ///< GUID of the reader of its replies
  std::uint64_t sequence = 0;             ///< of the request among its writer's
  std::uint16_t parameter = 0;            ///< by which its inline QoS says so: 0x0083 or 0x800f
};

/// Whether clients of Fast DDS are answered: with Cyclone DDS 0.10, whose inside is known.
[[nodiscard]] bool answers_fast_dds() noexcept;

/// A topic whose samples come and go in both layouts, beside others that have the same name and
/// type. Below 1: the error's code.
/// @param layout  set to what write_reply() needs; lives as long as the topic
[[nodiscard]] dds_entity_t create_service_topic(dds_entity_t participant, const Type& type,
                                                const char* name, const ddsi_sertype** layout);

/// That of a request which a reader of such a topic took; empty: it has Cyclone DDS's layout.
[[nodiscard]] std::optional<FastCall> fast_call_of(const ddsi_serdata* request);

/// Sends a reply in the layout of who asked. Readers of Cyclone DDS ignore what is not theirs.
/// @param sample  of the topic's type
/// @return false: it was not sent.
[[nodiscard]] bool write_reply(dds_entity_t writer, const ddsi_sertype* layout, const void* sample,
                               const std::optional<FastCall>& call);

}  // namespace tandem::dds
