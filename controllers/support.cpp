// Least-squares distribution of the base's wrench over contact points that only push; points that
// would pull are dropped, round by round.
#include "controllers/support.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>

namespace tandem {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using RowMajor3 = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

/// S b = e with the smallest b; directions in which the points hardly spread take no part.
Vector2d solve(const Eigen::Matrix2d& S, const Vector2d& e) noexcept TANDEM_RT {
  constexpr double kNoSpread_m2 = 1e-8;  // a tenth of a millimetre
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> axes;
  axes.computeDirect(S);
  Vector2d b = Vector2d::Zero();
  for (Eigen::Index i = 0; i < 2; ++i) {
    if (!(axes.eigenvalues()[i] > kNoSpread_m2)) continue;
    const Vector2d axis = axes.eigenvectors().col(i);
    b += axis * (axis.dot(e) / axes.eigenvalues()[i]);
  }
  return b;
}

}  // namespace

Support::Support(std::span<const FootContact> feet) {
  for (const FootContact& foot : feet) {
    for (const auto& point : foot.points_m) {
      points_.push_back({.foot = sites_.size(),
                         .weight = 1.0 / static_cast<double>(foot.points_m.size()),
                         .in_site_m = Eigen::Map<const Vector3d>(point.data()),
                         .position_m = Vector3d::Zero(),
                         .force_N = Vector3d::Zero()});
    }
    sites_.push_back(foot.site);
  }
}

/// Vertical forces n = w (a + b (p - c)) of the points that push: the least sum of n^2 / w with
/// sum n = force and sum n p = first.
/// @return false when the ground has nothing to carry.
bool Support::share_vertical(double force_N, const Vector2d& first_Nm) noexcept TANDEM_RT {
  for (Point& point : points_) {
    point.pushes = force_N > 0.0;
    point.force_N.setZero();
  }
  bool pulls = force_N > 0.0;
  for (std::size_t round = 0; pulls && round < points_.size(); ++round) {
    double weight = 0.0;
    Vector2d middle = Vector2d::Zero();
    for (const Point& point : points_) {
      if (!point.pushes) continue;
      weight += point.weight;
      middle += point.weight * point.position_m.head<2>();
    }
    middle /= weight;
    Eigen::Matrix2d spread = Eigen::Matrix2d::Zero();
    for (const Point& point : points_) {
      if (!point.pushes) continue;
      const Vector2d from = point.position_m.head<2>() - middle;
      spread += point.weight * (from * from.transpose());
    }
    const Vector2d slope = solve(spread, first_Nm - force_N * middle);
    pulls = false;
    for (Point& point : points_) {
      if (!point.pushes) continue;
      const double lean = slope.dot(point.position_m.head<2>() - middle);
      point.force_N.z() = point.weight * (force_N / weight + lean);
      if (point.force_N.z() >= 0.0) continue;
      point.pushes = false;  // at least one of the others carries, the sum being positive
      point.force_N.z() = 0.0;
      pulls = true;
    }
  }
  return force_N > 0.0;
}

/// @param moment_Nm  about the vertical through W's origin
void Support::share_horizontal(const Vector3d& force_N, double moment_Nm) noexcept TANDEM_RT {
  Vector2d pressure = Vector2d::Zero();
  for (const Point& p : points_) {
    pressure += p.position_m.head<2>() * (p.force_N.z() / force_N.z());
  }
  double spread = 0.0;
  for (const Point& p : points_) {
    spread += p.force_N.z() * (p.position_m.head<2>() - pressure).squaredNorm();
  }
  const double turn_Nm = moment_Nm - (pressure.x() * force_N.y() - pressure.y() * force_N.x());
  const double turn = spread > 1e-9 * force_N.z() ? turn_Nm / spread : 0.0;
  for (Point& p : points_) {
    const Vector2d from = p.position_m.head<2>() - pressure;
    p.force_N.head<2>() =
        p.force_N.z() * (force_N.head<2>() / force_N.z() + turn * Vector2d(-from.y(), from.x()));
  }
}

void Support::carry(const tandem_kernels& kernels, std::span<const double> q,
                    std::span<const double> pose, std::span<const double> J,
                    std::span<double> tau) noexcept TANDEM_RT {
  const std::size_t nv = kernels.nv;
  const auto origin = [&](const Point& point) -> Vector3d {
    return Eigen::Map<const Vector3d>(&pose[12 * sites_[point.foot] + 9]);
  };
  double height = 0.0;
  for (Point& point : points_) {
    const Eigen::Map<const RowMajor3> R(&pose[12 * sites_[point.foot]]);
    point.position_m = R * point.in_site_m + origin(point);
    height += point.position_m.z() / static_cast<double>(points_.size());
  }
  // The wrench on the base in W's axes; its moment about W's vertical at the points' height.
  const Eigen::Quaterniond R(q[6], q[3], q[4], q[5]);
  const Vector3d force = R * Vector3d(tau[0], tau[1], tau[2]);
  const Vector3d moment =
      R * Vector3d(tau[3], tau[4], tau[5]) + Vector3d(q[0], q[1], q[2] - height).cross(force);
  if (share_vertical(force.z(), {-moment.y(), moment.x()})) share_horizontal(force, moment.z());
  for (std::size_t foot = 0; foot < sites_.size(); ++foot) {
    Vector3d push = Vector3d::Zero();
    Vector3d about_site = Vector3d::Zero();
    for (const Point& point : points_) {
      if (point.foot != foot) continue;
      push += point.force_N;
      about_site += (point.position_m - origin(point)).cross(point.force_N);
    }
    const double* rows = &J[6 * nv * sites_[foot]];
    for (std::size_t i = 6; i < nv; ++i) {
      for (std::size_t k = 0; k < 3; ++k) {
        const auto axis = static_cast<Eigen::Index>(k);
        tau[i] -= rows[k * nv + i] * push[axis] + rows[(k + 3) * nv + i] * about_site[axis];
      }
    }
  }
  for (std::size_t i = 0; i < 6; ++i) tau[i] = 0.0;
}

}  // namespace tandem
