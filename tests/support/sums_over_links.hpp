// Dynamics of a tree straight from its links, in long double: sums over links with Jacobians in
// the world, no recursion over forces or inertias, no frames but the description's. Shares only
// the tree with the generator, so that it is a witness of everything that comes after it.
#pragma once

#include <Eigen/Dense>
#include <Eigen/Geometry>
#include <span>
#include <vector>

#include "model/dynamics.hpp"
#include "model/model_spec.hpp"
#include "model/tree.hpp"

namespace tandem::model {

using Real = long double;
using RealVector = Eigen::Matrix<Real, Eigen::Dynamic, 1>;
using RealMatrix = Eigen::Matrix<Real, Eigen::Dynamic, Eigen::Dynamic>;

/// One state of a tree. With the kernels' inputs come the kernels' outputs, in their layout.
class SumsOverLinks {
 public:
  /// @param q, v  of the kernels: base first, then the joints in the tree's order.
  SumsOverLinks(const Tree& tree, const ModelSpec& spec, std::span<const double> q,
                std::span<const double> v);

  [[nodiscard]] RealMatrix mass_matrix() const;
  [[nodiscard]] RealVector bias() const;
  [[nodiscard]] RealVector inverse_dynamics(std::span<const double> vdot,
                                            std::span<const double> wrench) const;
  [[nodiscard]] RealVector forward_dynamics(std::span<const double> tau,
                                            std::span<const double> wrench) const;

  /// The outputs of one kernel, given its inputs beyond q and v, in the order of model/kernels.h.
  [[nodiscard]] std::vector<std::vector<double>> outputs(
      Kernel kernel, const std::vector<std::vector<double>>& in) const;

 private:
  using Vector3 = Eigen::Matrix<Real, 3, 1>;
  using Matrix3 = Eigen::Matrix<Real, 3, 3>;
  using Jacobian = Eigen::Matrix<Real, 6, Eigen::Dynamic>;  // linear, angular; in the world

  struct Frame {
    Matrix3 R = Matrix3::Identity();
    Vector3 p = Vector3::Zero();
    int body = 0;
  };
  struct Column {  // one coordinate of velocity
    int body = 0;  // the one that it moves
    bool slides = false;
    Vector3 axis, point;                  // in the world
    Vector3 axis_rate = Vector3::Zero();  // time derivatives
    Vector3 point_rate = Vector3::Zero();
  };
  struct Mass {  // of one link
    Real kg;
    Vector3 com;
    Matrix3 inertia;  // about the com, world axes
    int body;
    int link;
    Jacobian J;  // of the com
    Eigen::Matrix<Real, 6, 1> Jdot_v;
  };

  void place_bodies(std::span<const double> q);
  void move_bodies();
  [[nodiscard]] bool moves(int body, const Column& column) const;
  [[nodiscard]] Frame on_link(int link, const SiteSpec* site) const;
  [[nodiscard]] Vector3 velocity_of(int body, const Vector3& point) const;
  [[nodiscard]] Jacobian jacobian(int body, const Vector3& point) const;
  [[nodiscard]] Eigen::Matrix<Real, 6, 1> jacobian_rate_times_v(int body,
                                                                const Vector3& point) const;
  [[nodiscard]] RealVector external(std::span<const double> wrench) const;
  [[nodiscard]] std::vector<std::vector<double>> center_of_mass() const;
  [[nodiscard]] std::vector<std::vector<double>> generalised_momentum(
      std::span<const double> wrench) const;
  [[nodiscard]] std::vector<double> momentum() const;
  [[nodiscard]] std::vector<double> energy() const;
  [[nodiscard]] std::vector<std::vector<double>> site_motion(std::span<const double> vdot) const;
  [[nodiscard]] std::vector<double> site_jacobians() const;
  [[nodiscard]] std::vector<double> sensors(std::span<const double> vdot,
                                            std::span<const double> wrench) const;

  const Tree& tree_;
  const ModelSpec& spec_;
  RealVector v_;
  RealVector armature_;
  Vector3 gravity_;
  std::vector<Frame> bodies_;     // placement of each body
  std::vector<Vector3> angular_;  // velocity of each body
  std::vector<Column> columns_;
  std::vector<Mass> masses_;  // of the links that move
  Real total_ = 0;
};

}  // namespace tandem::model
