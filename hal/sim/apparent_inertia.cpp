// The mass matrix and its inverse in a fixed, low-discrepancy sequence of postures: a joint
// is lightest with all others free, 1 / (M^-1)_ii, and heaviest with them locked, M_ii.
#include "hal/sim/apparent_inertia.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>

namespace tandem::sim {
namespace {

/// A share of a range, 0 to 1: a Weyl sequence, the same on every machine.
class Shares {
 public:
  double next() {
    state_ += 0x9E3779B97F4A7C15U;
    return static_cast<double>(state_ >> 11) * 0x1.0p-53;
  }

 private:
  std::uint64_t state_ = 0;
};

PostureInertia posture_at(AddedInertia& dynamics, std::vector<double> q) {
  const tandem_kernels& kernels = dynamics.kernels();
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  RowMajor M(kernels.nv, kernels.nv);
  kernels.mass_matrix(q.data(), M.data());
  dynamics.add_to_mass_matrix(q.data(), M.data());
  const Eigen::LLT<Eigen::MatrixXd> factor(M);
  return {std::move(q), M, factor.solve(Eigen::MatrixXd::Identity(kernels.nv, kernels.nv))};
}

}  // namespace

std::size_t joint_of(const tandem_kernels& kernels, const std::string& name) {
  return static_cast<std::size_t>(
      std::find(kernels.joint_names, kernels.joint_names + kernels.joints, name) -
      kernels.joint_names);
}

std::vector<PostureInertia> postures_within(AddedInertia dynamics, std::span<const double> start,
                                            std::span<const JointRange> ranges, int more) {
  const tandem_kernels& kernels = dynamics.kernels();
  const std::size_t first = kernels.nq - kernels.joints;
  std::vector<PostureInertia> postures;
  postures.push_back(posture_at(dynamics, {start.begin(), start.end()}));
  Shares shares;
  for (int n = 0; n < more; ++n) {
    std::vector<double> q(start.begin(), start.end());
    for (std::size_t i = first; i < q.size(); ++i) {
      q[i] += std::numbers::pi * (2.0 * shares.next() - 1.0);
    }
    for (const JointRange& range : ranges) {
      const std::size_t joint = joint_of(kernels, range.joint);
      if (joint == kernels.joints || !std::isfinite(range.upper_rad - range.lower_rad)) continue;
      q[first + joint] = range.lower_rad + shares.next() * (range.upper_rad - range.lower_rad);
    }
    postures.push_back(posture_at(dynamics, std::move(q)));
  }
  return postures;
}

std::vector<JointInertia> joint_inertias(const tandem_kernels& kernels,
                                         std::span<const PostureInertia> postures) {
  const Eigen::Index base = kernels.nv - kernels.joints;
  std::vector<JointInertia> all(kernels.joints, {std::numeric_limits<double>::infinity(), 0.0});
  for (const PostureInertia& posture : postures) {
    for (std::size_t i = 0; i < all.size(); ++i) {
      const Eigen::Index at = base + static_cast<Eigen::Index>(i);
      all[i].least = std::min(all[i].least, 1.0 / posture.mobility(at, at));
      all[i].most = std::max(all[i].most, posture.M(at, at));
    }
  }
  return all;
}

double point_mass(const PostureInertia& posture, const PointJacobian& J) {
  PointJacobian moved(J.rows(), 3);  // by a unit force along each axis
  for (Eigen::Index axis = 0; axis < 3; ++axis)
    moved.col(axis).noalias() = posture.mobility * J.col(axis);
  const Eigen::Matrix3d mobility = J.transpose() * moved;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(mobility, Eigen::EigenvaluesOnly);
  return 1.0 / eigen.eigenvalues()(2);
}

}  // namespace tandem::sim
