// A tree at one posture: where its pieces stand and what each joint carries.
// Layer: scaffold.  Thread: any, non-RT.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "model/tree.hpp"

namespace tandem::scaffold {

inline constexpr double kGravity_m_s2 = 9.81;

/// Frame W stands at the root's frame, z up. Everything is in W.
class Posed {
 public:
  /// @param q  (joints) [rad or m], in the tree's order
  /// @pre q.size() == tree.joints.size()
  Posed(const model::Tree& tree, const Eigen::VectorXd& q);

  [[nodiscard]] const model::Placement& body(int index) const { return bodies_[index]; }
  [[nodiscard]] model::Placement link(int index) const;
  /// A joint's origin and its axis.
  [[nodiscard]] Eigen::Vector3d origin(int joint) const { return bodies_[joint + 1].p; }
  [[nodiscard]] Eigen::Vector3d axis(int joint) const;
  [[nodiscard]] bool slides(int joint) const;

  /// All that joint `joint` carries, and all that moves when the base does.
  [[nodiscard]] const model::Inertia& beyond(int joint) const { return beyond_[joint + 1]; }
  [[nodiscard]] const model::Inertia& whole() const { return beyond_[0]; }
  /// M's diagonal entry [kg m^2 or kg], without rotors: n^T I n about the joint's origin.
  [[nodiscard]] double inertia(int joint) const;
  /// What the joint must give against gravity when nothing beyond it is supported [Nm or N].
  [[nodiscard]] double gravity_load(int joint) const;

  /// (3 x joints) velocity of a point fixed to `body`; columns of joints before it only.
  [[nodiscard]] Eigen::MatrixXd point_jacobian(int body, const Eigen::Vector3d& point) const;
  /// (3 x joints) angular velocity of `body`.
  [[nodiscard]] Eigen::MatrixXd turn_jacobian(int body) const;
  /// (3 x joints) velocity of the centre of mass.
  [[nodiscard]] Eigen::MatrixXd com_jacobian() const;

 private:
  const model::Tree& tree_;
  std::vector<model::Placement> bodies_;
  std::vector<model::Inertia> beyond_;  ///< per body: its own and all that hangs on it
};

/// Joints between the root and `body`, the root's side first.
[[nodiscard]] std::vector<int> path_to(const model::Tree& tree, int body);

}  // namespace tandem::scaffold
