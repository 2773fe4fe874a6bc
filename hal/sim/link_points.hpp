// The points at which links other than soles touch the ground.
// Layer: hal/sim.  Thread: non-RT only.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "hal/config/robot_config.hpp"
#include "model/tree.hpp"

namespace tandem::sim {

struct LinkPoints {
  std::size_t link = 0;  ///< in the tree
  bool guessed = false;  ///< from mass and inertia, for the link has no shape that can be used
  std::vector<Eigen::Vector3d> in_body_m{};  ///< in the frame of the link's body
};

/// Corners of a box, four points of each rim of a cylinder, the two ends of a capsule and three of
/// each rim, six of a sphere. A link with mass and no such shape gets the corners of the
/// homogeneous box with its mass and inertia, shrunk to 200 kg/m^3 where it is larger.
///
/// Left out: what stands still, soles' links, and above each of them the ankle: links that are
/// nearer to the one below than a fifth of the leg's length.
[[nodiscard]] std::vector<LinkPoints> link_points(const hal::RobotConfig& robot,
                                                  const model::Tree& tree);

}  // namespace tandem::sim
