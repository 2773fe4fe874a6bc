// A tree at one posture: where its pieces stand and what each joint carries.
// Layer: scaffold.  Thread: any, non-RT.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "model/tree.hpp"

namespace tandem::scaffold {

inline constexpr double kGravity_m_s2 = 9.81;

/// Frame W stands at the root's frame, z up. Everything is in W. A follower (URDF: mimic) stands
/// where its leader puts it; its inertia, its load and its columns count as its leader's.
class Posed {
 public:
  /// @param q  (joints) [rad or m], in the tree's order; a follower's entry is not read
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
  /// @pre  here and below: `joint` follows nobody
  [[nodiscard]] double inertia(int joint) const;
  /// What the joint must give against gravity when nothing beyond it is supported [Nm or N].
  [[nodiscard]] double gravity_load(int joint) const;

  /// (joints) what the joints give to accelerate from rest [Nm or N]: M qdd, without rotors and
  /// with the root at rest; 0 for followers.
  /// @param qdd  (joints) [rad/s^2 or m/s^2]; a follower's entry is not read
  [[nodiscard]] Eigen::VectorXd inertial_load(const Eigen::VectorXd& qdd) const;
  /// The lowest of the frames of what moves, and of the centres of mass [m], over the root's.
  [[nodiscard]] double lowest_m() const;

  /// (3 x joints) velocity of a point fixed to `body`; columns of joints before it only.
  [[nodiscard]] Eigen::MatrixXd point_jacobian(int body, const Eigen::Vector3d& point) const;
  /// (3 x joints) angular velocity of `body`.
  [[nodiscard]] Eigen::MatrixXd turn_jacobian(int body) const;
  /// (3 x joints) velocity of the centre of mass.
  [[nodiscard]] Eigen::MatrixXd com_jacobian() const;

 private:
  [[nodiscard]] std::vector<int> followers_of(int joint) const;
  [[nodiscard]] double inertia_with_followers(int joint) const;
  [[nodiscard]] double own_gravity_load(int joint) const;
  [[nodiscard]] Eigen::MatrixXd of_coordinates(Eigen::MatrixXd J) const;

  const model::Tree& tree_;
  std::vector<int> followers_;
  std::vector<model::Placement> bodies_;
  std::vector<model::Inertia> beyond_;  ///< per body: its own and all that hangs on it
};

}  // namespace tandem::scaffold
