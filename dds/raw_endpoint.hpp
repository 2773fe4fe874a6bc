// A topic and its writer or reader, with ROS 2's encoding and type hash; in no graph.
// Layer: dds.  Thread: any, non-RT: no DDS call is fit for the real-time thread.
#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "base/result.hpp"
#include "dds/entity.hpp"
#include "dds/types.hpp"

namespace tandem::dds {

enum class EndpointKind : std::uint8_t { kWriter, kReader };

/// Quality of service of one endpoint. Both ends must fit: a reader that is reliable or transient
/// local finds no writer that is less.
struct Qos {
  bool reliable = true;
  bool transient_local = false;  ///< late readers get the last `depth` samples
  std::int32_t depth = 10;       ///< samples that are kept for readers, or until they are taken
  std::string user_data{};       ///< "key=value;…": what it says of itself before its type's hash
};

/// Makes the DDS topic of an endpoint. Below 1: the error's code.
using MakeTopic =
    std::function<dds_entity_t(dds_entity_t participant, const Type& type, const char* name)>;
/// One whose samples are encoded as idlc's types are.
[[nodiscard]] dds_entity_t make_topic(dds_entity_t participant, const Type& type, const char* name);

struct RawEndpoint {
  Entity topic;
  Entity entity;  ///< after the topic, so that it goes first

  /// @param topic  the DDS name: "rt/joint_states"
  /// Errors: what Cyclone DDS refuses, such as a topic that has another type in this process.
  [[nodiscard]] static Result<RawEndpoint> create(EndpointKind kind, dds_entity_t participant,
                                                  const Type& type, const std::string& topic,
                                                  const Qos& qos,
                                                  const MakeTopic& make = &make_topic);
};

}  // namespace tandem::dds
