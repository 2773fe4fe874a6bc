// The robot's links as a tree of frames, as tf has them.
// Layer: dds.  Thread: any, non-RT.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "hal/config/robot_config.hpp"
#include "model/tree.hpp"

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

}  // namespace tandem::dds
