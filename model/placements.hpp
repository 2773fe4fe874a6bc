// Where bodies stand, in doubles: for whoever looks at a posture without a robot's kernels.
// Layer: model.  Thread: any.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <span>
#include <vector>

#include "model/tree.hpp"

namespace tandem::model {

/// A frame as URDF writes it: roll, pitch, yaw about fixed axes.
[[nodiscard]] inline Placement placement_of(const std::array<double, 3>& xyz_m,
                                            const std::array<double, 3>& rpy_rad) {
  using Eigen::AngleAxisd;
  using Eigen::Vector3d;
  return {(AngleAxisd(rpy_rad[2], Vector3d::UnitZ()) * AngleAxisd(rpy_rad[1], Vector3d::UnitY()) *
           AngleAxisd(rpy_rad[0], Vector3d::UnitX()))
              .toRotationMatrix(),
          Vector3d(xyz_m.data())};
}

/// Roll, pitch, yaw about fixed axes of such a frame [rad]; where the pitch is a right angle, the
/// yaw is 0.
[[nodiscard]] inline std::array<double, 3> rpy_of(const Eigen::Matrix3d& R) {
  const double across = std::hypot(R(0, 0), R(1, 0));
  const double pitch = std::atan2(-R(2, 0), across);
  if (across < 1e-9) return {std::atan2(-R(1, 2), R(1, 1)), pitch, 0.0};
  return {std::atan2(R(2, 1), R(2, 2)), pitch, std::atan2(R(1, 0), R(0, 0))};
}

/// Where every body stands in the world, the base first.
///
/// @param position  of every joint of the tree [rad or m]; those of followers are not looked at,
///                  for their leaders say where they are
[[nodiscard]] inline std::vector<Placement> place_bodies(const Tree& tree,
                                                         std::span<const double> position,
                                                         const Placement& base = {}) {
  std::vector<Placement> bodies{base};
  for (std::size_t j = 0; j < tree.joints.size(); ++j) {
    const Joint& joint = tree.joints[j];
    const std::size_t own = joint.follows() ? static_cast<std::size_t>(joint.leader) : j;
    const double q = joint.multiplier * position[own] + joint.offset;
    Placement motion;
    if (joint.type == JointType::kPrismatic) {
      motion.p = q * joint.axis;
    } else {
      motion.R = Eigen::AngleAxisd(q, joint.axis).toRotationMatrix();
    }
    bodies.push_back(bodies[static_cast<std::size_t>(joint.parent)] * joint.in_parent * motion);
  }
  return bodies;
}

}  // namespace tandem::model
