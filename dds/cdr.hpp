// Samples as bytes: decodes CDR by a message's definition, whatever the bytes are, and encodes
// idlc's C structures.
// Layer: dds.  Thread: any, non-RT.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "base/result.hpp"
#include "dds/message_definition.hpp"

namespace tandem::dds {

struct Member;

/// A field's value: integers that are signed as int64_t, others as uint64_t, float32 as double.
struct Value {
  using List = std::vector<Value>;      ///< of an array or sequence
  using Message = std::vector<Member>;  ///< in the order of the definition's fields
  std::variant<bool, std::int64_t, std::uint64_t, double, std::string, List, Message> of;
};

struct Member {
  std::string_view name;  ///< the definition's own: it outlives the value
  Value value;
};

/// Decodes one sample. Memory stays within a constant times the bytes' number.
///
/// A request or response begins with the members "request_guid" and "request_sequence".
/// @param definition  resolved
/// @param bytes  with the four bytes in front that name the encoding, as dds_takecdr gives them
/// Errors: another encoding than plain CDR (XCDR1), bytes too few or too many, a length beyond
/// what is there or allowed, a bool that is neither 0 nor 1, a string that does not end.
[[nodiscard]] Result<Value> decode(const MessageDefinition& definition,
                                   std::span<const std::byte> bytes);

/// The same of ROS 1's encoding: little-endian, without padding, and with the number that its
/// header has besides. `definition` is ROS 2's of the same message.
[[nodiscard]] Result<Value> decode_ros1(const MessageDefinition& definition,
                                        std::span<const std::byte> bytes);

/// A sample of idlc's C structure as plain CDR, little endian, with the four bytes in front.
/// @param definition  resolved; of the sample's type
/// @param sample      its texts and sequences are there
[[nodiscard]] std::string encode(const MessageDefinition& definition, const void* sample);
/// Bytes of the C structure that encode() takes: idlc's own sizeof.
[[nodiscard]] std::size_t structure_bytes(const MessageDefinition& definition);

/// A member of a message by its name; null when it has none, or is no message.
[[nodiscard]] const Value* find(const Value& value, std::string_view name);

}  // namespace tandem::dds
