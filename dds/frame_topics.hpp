// tf, tf_static, odom and robot_description: where the robot's links are.
// Layer: dds.  Thread: the publisher's.
#pragma once

#include <string>
#include <vector>

#include "dds/message_parts.hpp"
#include "dds/topic_group.hpp"

namespace tandem::dds {

/// One edge of the tree of frames: the child link in its parent link's frame.
struct FrameEdge {
  std::string parent;
  std::string child;
  model::Placement at_zero;  ///< of the child in the parent, the joint at 0
  model::JointType type = model::JointType::kRevolute;
  Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();  ///< in the child's frame
  std::size_t joint = 0;                            ///< in the image, of a moving one
  double multiplier = 1.0;                          ///< of that joint's position, where the edge
  double offset = 0.0;                              ///< follows it (URDF: mimic)
};

/// The URDF's frames: the joints that move, and those that are fixed or locked.
struct FrameTree {
  std::vector<FrameEdge> moving, fixed;
};
[[nodiscard]] FrameTree frame_tree(const model::Tree& tree, const hal::RobotConfig& robot);
/// @param position  of `edge.joint`
[[nodiscard]] model::Placement placement(const FrameEdge& edge, double position);

/// A floating base stands in the frame "odom", where the simulation's truth has it; nobody knows
/// where that of a real robot stands, and a fixed base is the root.
class FrameTopics final : public TopicGroup {
 public:
  FrameTopics(OutputMaker& maker, const RunDescription& run);
  void begin(std::int64_t stamp_ns) override;
  void publish(const CycleSample& sample) override;

 private:
  using Stamped = geometry_msgs_msg_dds__TransformStamped_;
  void publish_moving(const CycleSample& sample);
  void publish_odometry(const CycleSample& sample);

  FrameTree frames_;
  std::string urdf_, odom_, base_;
  bool base_known_;
  std::vector<Stamped> transforms_;
  Output<tf2_msgs::TFMessage> tf_, tf_static_;
  Output<nav_msgs::Odometry> odometry_;
  Output<std_msgs::String> description_;
};

}  // namespace tandem::dds
