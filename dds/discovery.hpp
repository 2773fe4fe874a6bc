// Who writes and reads which topic in the domain, by discovery.
// Layer: dds.  Thread: any, non-RT.
#pragma once

#include <string>
#include <vector>

#include "base/result.hpp"
#include "dds/participant.hpp"
#include "dds/raw_endpoint.hpp"

namespace tandem::dds {

/// One topic with a type, and all its endpoints but those of the participant that looks.
struct TopicInfo {
  std::string topic;  ///< DDS name: "rt/joint_states"
  std::string type;   ///< DDS name: "sensor_msgs::msg::dds_::JointState_"
  std::size_t writers = 0;
  std::size_t readers = 0;
  /// Least QoS of the writers, or of the readers when there is no writer: what each of them has.
  Qos qos;

  /// "/joint_states"; empty when it is no topic of ROS 2 (a service's, or the graph's).
  [[nodiscard]] std::string ros_name() const;
  /// "sensor_msgs/msg/JointState"; the DDS name of a type that is not ROS 2's.
  [[nodiscard]] std::string ros_type() const;
};

/// Looks from the time when it is opened: the first answers come within tenths of a second.
class Discovery {
 public:
  /// The participant outlives it.
  [[nodiscard]] static Result<Discovery> open(const Participant& participant);

  /// What is known now, in the order of names.
  [[nodiscard]] std::vector<TopicInfo> topics() const;

 private:
  Discovery(dds_guid_t self, Entity writers, Entity readers)
      : self_(self), writers_(std::move(writers)), readers_(std::move(readers)) {}

  dds_guid_t self_;  // of the participant
  Entity writers_, readers_;
};

}  // namespace tandem::dds
