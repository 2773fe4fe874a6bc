// The message types that Tandem knows, as table: what a topic's type is called, how its samples are
// encoded, and its definition as ROS 2 has it.
// Layer: dds.  Thread: any, non-RT.
#pragma once

#include <dds/dds.h>
#include <ros2.h>
#include <tandem_link.h>
#include <tandem_msgs.h>

#include <span>
#include <string>
#include <string_view>

#include "dds/message_definition.hpp"

namespace tandem::dds {

/// One type.
struct Type {
  const dds_topic_descriptor_t* descriptor;
  std::string ros_name;           ///< "sensor_msgs/msg/JointState"
  const MessageDefinition* tree;  ///< its fields
  std::string definition;         ///< the .msg text with those that it needs ("ros2msg")
  std::string hash;               ///< "RIHS01_…", what both ends must agree on

  [[nodiscard]] const char* dds_name() const { return descriptor->m_typename; }
};

/// Every type of a topic or a service that Tandem knows.
[[nodiscard]] std::span<const Type> types();
/// By either name; null when it is unknown.
[[nodiscard]] const Type* find_type(std::string_view name);
/// That of a descriptor. @pre it is one of types()
[[nodiscard]] const Type& type_of(const dds_topic_descriptor_t& descriptor);

// The C types of idlc under the names that they have in ROS 2, and their descriptors.
template <class T>
struct DescriptorOf;

#define TANDEM_DDS_TYPE(package, kind, Name)                                                      \
  namespace package {                                                                             \
  using Name = ::package##_##kind##_dds__##Name##_;                                               \
  }                                                                                               \
  template <>                                                                                     \
  struct DescriptorOf<::package##_##kind##_dds__##Name##_> {                                      \
    static const dds_topic_descriptor_t& get() { return package##_##kind##_dds__##Name##__desc; } \
  };
#include "dds/type_list.inc"
#undef TANDEM_DDS_TYPE

/// The table's row of a C type: `type<sensor_msgs::JointState>()`.
template <class T>
[[nodiscard]] const Type& type() {
  return type_of(DescriptorOf<T>::get());
}

}  // namespace tandem::dds
