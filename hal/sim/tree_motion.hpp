// Where every body of the tree is and how it moves, and what forces on bodies are as generalized
// ones: for forces at places where the kernels know no site.
// Layer: hal/sim.  Thread: create non-RT; the rest RT.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "base/realtime.hpp"
#include "hal/sim/rotation.hpp"
#include "model/kernels.h"
#include "model/tree.hpp"

namespace tandem::sim {

[[nodiscard]] inline Vec3 vec3(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }
[[nodiscard]] inline Mat3 mat3(const Eigen::Matrix3d& R) {
  return {R(0, 0), R(0, 1), R(0, 2), R(1, 0), R(1, 1), R(1, 2), R(2, 0), R(2, 1), R(2, 2)};
}
[[nodiscard]] inline Vec3 sum(const Vec3& a, const Vec3& b) noexcept {
  return {a[0] + b[0], a[1] + b[1], a[2] + b[2]};
}
[[nodiscard]] inline double dot(const Vec3& a, const double* b) noexcept {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
[[nodiscard]] Mat3 product(const Mat3& A, const Mat3& B) noexcept TANDEM_RT;

/// Whether a link is `first`, or further from the root than it.
[[nodiscard]] inline bool is_beyond(const model::Tree& tree, int link, int first) {
  while (link >= 0 && link != first) link = tree.links[static_cast<std::size_t>(link)].parent;
  return link == first;
}

/// Body 0 is the base, or what stands still; joint j moves body j + 1, as in model::Tree.
class TreeMotion {
 public:
  struct JointFrame {
    std::size_t parent;      // body; this joint's is its own index + 1
    std::size_t coordinate;  // of the kernels' joints
    double multiplier, offset;
    bool prismatic;
    Vec3 axis, p;  // in the joint's frame; in the parent's body
    Mat3 R;
  };
  struct BodyMotion {
    Mat3 R;
    Vec3 p, v, w;  // in W, of its origin
    Vec3 axis;     // of its joint, in W
  };

  TreeMotion() = default;
  TreeMotion(const model::Tree& tree, const tandem_kernels& kernels);

  /// Every body, at a state of the kernels.
  void place(const double* q, const double* v) noexcept TANDEM_RT;
  /// Adds to `forces` (nv) what forces on bodies are: from the tips to the base, without a
  /// Jacobian.
  /// @param body_force  six per body, in W, moment about W's origin; summed up in place
  /// @pre place()
  void add_generalized(double* body_force, double* forces) const noexcept TANDEM_RT;

  [[nodiscard]] bool floating() const noexcept { return floating_; }
  [[nodiscard]] const std::vector<JointFrame>& joints() const noexcept { return joints_; }
  [[nodiscard]] const std::vector<BodyMotion>& bodies() const noexcept { return bodies_; }

 private:
  bool floating_ = false;
  std::vector<JointFrame> joints_;
  std::vector<BodyMotion> bodies_;  // joints + 1
};

}  // namespace tandem::sim
