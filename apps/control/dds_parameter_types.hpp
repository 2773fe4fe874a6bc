// The parameters of a run's controllers as those of its ROS 2 node, "squat.link_damping_Nms_rad":
// requests of rcl_interfaces as questions to a registry, and its answers as their replies.
// Layer: apps/control.  Thread: any.
#pragma once

#include "apps/text/console.hpp"
#include "dds/service_server.hpp"
#include "dds/types.hpp"

namespace tandem::apps {

/// What a request asks of the registry, and what only the reply needs: the names in their order, or
/// prefixes and a depth; how many parameters it would set.
struct ParameterQuestion {
  Json question;
  Json refusal{};  ///< an answer: the registry is not asked; null: it is
  Json names = Json::array();
  std::size_t count = 0;
  std::uint64_t depth = 0;
};

namespace ros = dds::rcl_interfaces;

[[nodiscard]] ParameterQuestion question_of(const ros::ListParameters_Request& request);
[[nodiscard]] ParameterQuestion question_of(const ros::DescribeParameters_Request& request);
[[nodiscard]] ParameterQuestion question_of(const ros::GetParameters_Request& request);
[[nodiscard]] ParameterQuestion question_of(const ros::GetParameterTypes_Request& request);
/// Each by itself.
[[nodiscard]] ParameterQuestion question_of(const ros::SetParameters_Request& request);
/// All or none.
[[nodiscard]] ParameterQuestion question_of(const ros::SetParametersAtomically_Request& request);

// A name that no controller has is there without a value, as ROS 2's "not set".
void fill(const Json& answer, const ParameterQuestion& asked, ros::ListParameters_Response& reply,
          dds::ReplyMemory& memory);
void fill(const Json& answer, const ParameterQuestion& asked,
          ros::DescribeParameters_Response& reply, dds::ReplyMemory& memory);
void fill(const Json& answer, const ParameterQuestion& asked, ros::GetParameters_Response& reply,
          dds::ReplyMemory& memory);
void fill(const Json& answer, const ParameterQuestion& asked,
          ros::GetParameterTypes_Response& reply, dds::ReplyMemory& memory);
void fill(const Json& answer, const ParameterQuestion& asked, ros::SetParameters_Response& reply,
          dds::ReplyMemory& memory);
void fill(const Json& answer, const ParameterQuestion& asked,
          ros::SetParametersAtomically_Response& reply, dds::ReplyMemory& memory);

}  // namespace tandem::apps
