// The plane through all contact points by principal axes; where they leave it open, the base's z is
// up.
#include "controllers/ground_frame.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>

namespace tandem {

using Eigen::Vector3d;
using RowMajor3 = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

GroundFrame ground_under(std::span<const Foot> feet,
                         std::span<const double> pose) noexcept TANDEM_RT {
  const auto in_frame = [&](const Foot& foot, const std::array<double, 3>& point) -> Vector3d {
    const Eigen::Map<const RowMajor3> R(&pose[12 * foot.site]);
    return R * Eigen::Map<const Vector3d>(point.data()) +
           Eigen::Map<const Vector3d>(&pose[12 * foot.site + 9]);
  };
  GroundFrame ground{Eigen::Matrix3d::Identity(), Vector3d::Zero()};
  Vector3d middle = Vector3d::Zero();
  double count = 0.0;
  for (const Foot& foot : feet) {
    ground.origin_m += in_frame(foot, foot.middle_m) / static_cast<double>(feet.size());
    for (const auto& point : foot.points_m) {
      middle += in_frame(foot, point);
      count += 1.0;
    }
  }
  middle /= count;
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (const Foot& foot : feet) {
    for (const auto& point : foot.points_m) {
      const Vector3d from = in_frame(foot, point) - middle;
      spread += from * from.transpose() / count;
    }
  }
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes;
  axes.compute(spread);  // the widest is the last
  Vector3d up = Vector3d::UnitZ();
  if (axes.eigenvalues()[1] > kFootExtent_m * kFootExtent_m) {
    up = axes.eigenvectors().col(0);
    if (up.z() < 0.0) up = -up;
  } else if (axes.eigenvalues()[2] > kFootExtent_m * kFootExtent_m) {
    const Vector3d line = axes.eigenvectors().col(2);
    up = (up - line.z() * line).normalized();
  }
  const Vector3d ahead = (Vector3d::UnitX() - up.x() * up).normalized();
  ground.R << ahead, up.cross(ahead), up;
  return ground;
}

}  // namespace tandem
