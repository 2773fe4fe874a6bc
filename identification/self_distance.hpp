// How near a robot's links come to each other, by a simple geometry.
// Layer: identification.  Thread: any.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "model/tree.hpp"

namespace tandem::identification {

/// Every body is a few capsules: from its joint to each joint that it carries (a body without one:
/// to twice its center of mass), as thick as the homogeneous box of its mass and inertia is thin,
/// 2 cm at least and 8 cm at most. Meshes are not read. Pairs are of bodies with at least two
/// others between them; pairs that are nearer than 2 cm in the start posture need not be farther
/// later.
class SelfDistance {
 public:
  /// @param start  position of every joint of the tree
  SelfDistance(const model::Tree& tree, std::span<const double> start);

  /// How much room is left beyond what is required [m]; negative: too near.
  /// @param position  of every joint of the tree
  [[nodiscard]] double room(std::span<const double> position) const;

  static constexpr double kRequired_m = 0.02;

 private:
  struct Capsule {
    int body;
    Eigen::Vector3d from, to;  // in the body's frame
    double radius_m;
  };
  struct Pair {
    std::size_t a, b;
    double required_m;
  };
  [[nodiscard]] double distance(const Pair& pair, const std::vector<model::Placement>& at) const;

  const model::Tree* tree_;
  std::vector<Capsule> capsules_;
  std::vector<Pair> pairs_;
};

}  // namespace tandem::identification
