// The rule of tests/dds/cdr_sample.hpp's pattern() for the classes of fastddsgen: fills a message,
// or says whether it is filled so.
// Layer: tests.  Thread: any.
#pragma once

#include <array>
#include <cstdint>
#include <fastrtps/utils/fixed_size_string.hpp>
#include <string>
#include <type_traits>
#include <vector>

#include "ros2.h"

namespace peer {

// The members of each structure, in the order of its definition.
#define MEMBERS(Structure, ...)                                            \
  template <class Leaf>                                                    \
  void members(Structure& m, Leaf& leaf) {                                 \
    const auto all = [&](auto&... member) { (visit(member, leaf), ...); }; \
    all(__VA_ARGS__);                                                      \
  }

template <class T, class Leaf>
void visit(T& value, Leaf& leaf);

MEMBERS(builtin_interfaces::msg::dds_::Time_, m.sec(), m.nanosec())
MEMBERS(builtin_interfaces::msg::dds_::Duration_, m.sec(), m.nanosec())
MEMBERS(std_msgs::msg::dds_::Header_, m.stamp(), m.frame_id())
MEMBERS(std_msgs::msg::dds_::String_, m.data())
MEMBERS(std_msgs::msg::dds_::MultiArrayDimension_, m.label(), m.size(), m.stride())
MEMBERS(std_msgs::msg::dds_::MultiArrayLayout_, m.dim(), m.data_offset())
MEMBERS(std_msgs::msg::dds_::Float64MultiArray_, m.layout(), m.data())
MEMBERS(rcl_interfaces::msg::dds_::Log_, m.stamp(), m.level(), m.name(), m.msg(), m.file(),
        m.function(), m.line())
MEMBERS(rosgraph_msgs::msg::dds_::Clock_, m.clock())
MEMBERS(geometry_msgs::msg::dds_::Vector3_, m.x(), m.y(), m.z())
MEMBERS(geometry_msgs::msg::dds_::Point_, m.x(), m.y(), m.z())
MEMBERS(geometry_msgs::msg::dds_::Quaternion_, m.x(), m.y(), m.z(), m.w())
MEMBERS(geometry_msgs::msg::dds_::Pose_, m.position(), m.orientation())
MEMBERS(geometry_msgs::msg::dds_::PoseStamped_, m.header(), m.pose())
MEMBERS(geometry_msgs::msg::dds_::Twist_, m.linear(), m.angular())
MEMBERS(geometry_msgs::msg::dds_::TwistStamped_, m.header(), m.twist())
MEMBERS(geometry_msgs::msg::dds_::Wrench_, m.force(), m.torque())
MEMBERS(geometry_msgs::msg::dds_::WrenchStamped_, m.header(), m.wrench())
MEMBERS(geometry_msgs::msg::dds_::Transform_, m.translation(), m.rotation())
MEMBERS(geometry_msgs::msg::dds_::TransformStamped_, m.header(), m.child_frame_id(), m.transform())
MEMBERS(geometry_msgs::msg::dds_::PoseWithCovariance_, m.pose(), m.covariance())
MEMBERS(geometry_msgs::msg::dds_::TwistWithCovariance_, m.twist(), m.covariance())
MEMBERS(sensor_msgs::msg::dds_::JointState_, m.header(), m.name(), m.position(), m.velocity(),
        m.effort())
MEMBERS(sensor_msgs::msg::dds_::Imu_, m.header(), m.orientation(), m.orientation_covariance(),
        m.angular_velocity(), m.angular_velocity_covariance(), m.linear_acceleration(),
        m.linear_acceleration_covariance())
MEMBERS(sensor_msgs::msg::dds_::Joy_, m.header(), m.axes(), m.buttons())
MEMBERS(trajectory_msgs::msg::dds_::JointTrajectoryPoint_, m.positions(), m.velocities(),
        m.accelerations(), m.effort(), m.time_from_start())
MEMBERS(trajectory_msgs::msg::dds_::JointTrajectory_, m.header(), m.joint_names(), m.points())
MEMBERS(pal_statistics_msgs::msg::dds_::Statistic_, m.name(), m.value())
MEMBERS(pal_statistics_msgs::msg::dds_::Statistics_, m.header(), m.statistics())
MEMBERS(pal_statistics_msgs::msg::dds_::StatisticsNames_, m.header(), m.names(), m.names_version())
MEMBERS(pal_statistics_msgs::msg::dds_::StatisticsValues_, m.header(), m.values(),
        m.names_version())
MEMBERS(std_msgs::msg::dds_::ColorRGBA_, m.r(), m.g(), m.b(), m.a())
MEMBERS(sensor_msgs::msg::dds_::CompressedImage_, m.header(), m.format(), m.data())
MEMBERS(visualization_msgs::msg::dds_::UVCoordinate_, m.u(), m.v())
MEMBERS(visualization_msgs::msg::dds_::MeshFile_, m.filename(), m.data())
MEMBERS(visualization_msgs::msg::dds_::Marker_, m.header(), m.ns(), m.id(), m.type(), m.action(),
        m.pose(), m.scale(), m.color(), m.lifetime(), m.frame_locked(), m.points(), m.colors(),
        m.texture_resource(), m.texture(), m.uv_coordinates(), m.text(), m.mesh_resource(),
        m.mesh_file(), m.mesh_use_embedded_materials())
MEMBERS(visualization_msgs::msg::dds_::MarkerArray_, m.markers())
MEMBERS(tf2_msgs::msg::dds_::TFMessage_, m.transforms())
MEMBERS(nav_msgs::msg::dds_::Odometry_, m.header(), m.child_frame_id(), m.pose(), m.twist())
MEMBERS(diagnostic_msgs::msg::dds_::KeyValue_, m.key(), m.value())
MEMBERS(diagnostic_msgs::msg::dds_::DiagnosticStatus_, m.level(), m.name(), m.message(),
        m.hardware_id(), m.values())
MEMBERS(diagnostic_msgs::msg::dds_::DiagnosticArray_, m.header(), m.status())
MEMBERS(control_msgs::msg::dds_::InterfaceValue_, m.interface_names(), m.values())
MEMBERS(control_msgs::msg::dds_::DynamicJointState_, m.header(), m.joint_names(),
        m.interface_values())
MEMBERS(unique_identifier_msgs::msg::dds_::UUID_, m.uuid())
MEMBERS(action_msgs::msg::dds_::GoalInfo_, m.goal_id(), m.stamp())
MEMBERS(action_msgs::msg::dds_::GoalStatus_, m.goal_info(), m.status())
MEMBERS(action_msgs::msg::dds_::GoalStatusArray_, m.status_list())
MEMBERS(trajectory_msgs::msg::dds_::MultiDOFJointTrajectoryPoint_, m.transforms(), m.velocities(),
        m.accelerations(), m.time_from_start())
MEMBERS(control_msgs::action::dds_::FollowJointTrajectory_Feedback_, m.header(), m.joint_names(),
        m.desired(), m.actual(), m.error(), m.multi_dof_joint_names(), m.multi_dof_desired(),
        m.multi_dof_actual(), m.multi_dof_error())
MEMBERS(control_msgs::action::dds_::FollowJointTrajectory_FeedbackMessage_, m.goal_id(),
        m.feedback())
MEMBERS(rmw_dds_common::msg::dds_::Gid_, m.data())
MEMBERS(rmw_dds_common::msg::dds_::NodeEntitiesInfo_, m.node_namespace(), m.node_name(),
        m.reader_gid_seq(), m.writer_gid_seq())
MEMBERS(rmw_dds_common::msg::dds_::ParticipantEntitiesInfo_, m.gid(), m.node_entities_info_seq())
MEMBERS(rcl_interfaces::msg::dds_::ParameterValue_, m.type(), m.bool_value(), m.integer_value(),
        m.double_value(), m.string_value(), m.byte_array_value(), m.bool_array_value(),
        m.integer_array_value(), m.double_array_value(), m.string_array_value())
MEMBERS(rcl_interfaces::msg::dds_::Parameter_, m.name(), m.value())
MEMBERS(rcl_interfaces::msg::dds_::ParameterEvent_, m.stamp(), m.node(), m.new_parameters(),
        m.changed_parameters(), m.deleted_parameters())
MEMBERS(std_srvs::srv::dds_::Trigger_Request_, m.request_guid(), m.request_sequence(),
        m.structure_needs_at_least_one_member())
MEMBERS(std_srvs::srv::dds_::Trigger_Response_, m.request_guid(), m.request_sequence(), m.success(),
        m.message())
#undef MEMBERS

template <class T>
struct IsList : std::false_type {};
template <class T>
struct IsList<std::vector<T>> : std::true_type {};
template <class T, std::size_t N>
struct IsList<std::array<T, N>> : std::true_type {};
using Bounded = eprosima::fastrtps::fixed_string<256>;
template <class T>
constexpr bool kIsText = std::is_same_v<T, std::string> || std::is_same_v<T, Bounded>;

template <class T, class Leaf>
void visit(T& value, Leaf& leaf) {
  if constexpr (std::is_arithmetic_v<T> || kIsText<T>) {
    leaf(value);
  } else if constexpr (IsList<T>::value) {
    leaf.list(value);
    for (auto&& element : value) {
      if constexpr (std::is_same_v<T, std::vector<bool>>) {  // its elements are no objects
        bool one = element;
        leaf(one);
        element = one;
      } else {
        visit(element, leaf);
      }
    }
  } else {
    members(value, leaf);
  }
}

/// The n-th leaf's value, for its type.
template <class T>
auto nth(std::uint64_t n) {
  if constexpr (kIsText<T>) {
    return T("s" + std::to_string(n));
  } else if constexpr (std::is_same_v<T, bool>) {
    return n % 2 == 1;
  } else if constexpr (std::is_floating_point_v<T>) {
    return static_cast<T>(n) / 4;
  } else if constexpr (std::is_same_v<T, bool>) {
    return n % 2 == 1;
  } else {
    return static_cast<T>(n);
  }
}

class Fill {
 public:
  template <class T>
  void operator()(T& value) {
    value = nth<T>(++n_);
  }
  template <class T>
  void list(std::vector<T>& list) {
    list.resize(2);
  }
  template <class T, std::size_t N>
  void list(std::array<T, N>&) {}

 private:
  std::uint64_t n_ = 0;
};

class Check {
 public:
  template <class T>
  void operator()(T& value) {
    ++leaves_;
    same_ = same_ && value == nth<T>(leaves_);
  }
  template <class T>
  void list(std::vector<T>& list) {
    same_ = same_ && list.size() == 2;
  }
  template <class T, std::size_t N>
  void list(std::array<T, N>&) {}

  [[nodiscard]] bool same() const { return same_; }
  [[nodiscard]] std::uint64_t leaves() const { return leaves_; }

 private:
  std::uint64_t leaves_ = 0;
  bool same_ = true;
};

}  // namespace peer
