// ROS 2's message definitions (.msg, .srv, .action) as trees of fields, with what follows from
// them: the type's hash and the definition's text with all that it needs. Layer: dds.  Thread: any,
// non-RT.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.hpp"

namespace tandem::dds {

/// What one element of a field is. The numbers are those of ROS 2's type descriptions.
enum class MessageFieldType : std::uint8_t {
  kMessage = 1,
  kInt8 = 2,
  kUint8 = 3,
  kInt16 = 4,
  kUint16 = 5,
  kInt32 = 6,
  kUint32 = 7,
  kInt64 = 8,
  kUint64 = 9,
  kFloat32 = 10,
  kFloat64 = 11,
  kBool = 15,
  kByte = 16,
  kString = 17,
  kBoundedString = 21,
};

/// How often. The numbers are what ROS 2's type descriptions add to the type's.
enum class Repeat : std::uint8_t {
  kOne = 0,
  kArray = 48,
  kBoundedSequence = 96,
  kSequence = 144,
};

struct MessageDefinition;

struct MessageField {
  std::string name;
  MessageFieldType type;
  Repeat repeat = Repeat::kOne;
  std::uint64_t capacity = 0;         ///< elements: of an array; at most, of a bounded sequence
  std::uint64_t string_capacity = 0;  ///< characters at most, of a bounded string
  std::string message_name;           ///< "std_msgs/msg/Header"; of kMessage only
  const MessageDefinition* message = nullptr;  ///< that message, once it has been looked up
};

/// One message, or a service's request, response or event, or (of its three) a service, or (of its
/// goal, result, feedback, two services and a message) an action.
struct MessageDefinition {
  std::string name;                  ///< "sensor_msgs/msg/JointState"
  std::string text;                  ///< of the definition, without those that it needs
  std::vector<MessageField> fields;  ///< in the order of the wire; never empty
  /// On the wire 16 bytes precede the fields: who asked, and the request's number.
  bool request_or_response = false;
};

/// The trees of one file. A service gives four: request, response, event, itself. An action gives
/// goal, result and feedback, the services "…_SendGoal" and "…_GetResult", "…_FeedbackMessage",
/// itself.
/// @param name  of the type: "sensor_msgs/msg/JointState", "std_srvs/srv/Trigger",
///              "control_msgs/action/FollowJointTrajectory"
/// Errors: what is no definition, with the line; messages of others are not looked up yet.
[[nodiscard]] Result<std::vector<MessageDefinition>> parse_definition(std::string_view name,
                                                                      std::string_view text);

/// Looks up the messages that fields are of. Errors: one that is not there, or contains itself.
[[nodiscard]] Status resolve(std::vector<MessageDefinition>& definitions);

/// Every definition that Tandem has (dds/ros2, dds/tandem_msgs), resolved, in the order of names.
[[nodiscard]] std::span<const MessageDefinition> definitions();
/// By ROS 2's name; null when it is unknown.
[[nodiscard]] const MessageDefinition* find_definition(std::string_view ros_name);

/// "RIHS01_…": the SHA-256 of the type's description as JSON, as REP-2016 has it.
/// @pre it is resolved
[[nodiscard]] std::string type_hash(const MessageDefinition& definition);

/// The text followed by those of all messages in it, as logs carry it ("ros2msg").
/// @pre it is resolved
[[nodiscard]] std::string full_text(const MessageDefinition& definition);

}  // namespace tandem::dds
