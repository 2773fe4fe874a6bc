// Principal axes of a foot's contact points: a point, a line or a surface, each with what the
// ground can fix of it. Under all feet: the plane through the contact points; where they leave it
// open, the base's z is up.
#include "controllers/feet.hpp"

#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>

#include "base/nearest.hpp"
#include "controllers/model_map.hpp"

namespace tandem {
namespace {

/// Middle, shape and axis from the points: their spread along its principal axes.
void describe(FootContact& foot) {
  using Vector3 = Eigen::Vector3d;
  const auto count = static_cast<double>(foot.points_m.size());
  Vector3 middle = Vector3::Zero();
  for (const auto& point : foot.points_m) middle += Eigen::Map<const Vector3>(point.data()) / count;
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (const auto& point : foot.points_m) {
    const Vector3 from = Eigen::Map<const Vector3>(point.data()) - middle;
    spread += from * from.transpose() / count;
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(spread);  // the widest is the last
  const double extent = kFootExtent_m * kFootExtent_m;
  Vector3 axis = Vector3::Zero();
  if (axes.eigenvalues()[1] > extent) {
    foot.shape = FootShape::kSurface;
    axis = axes.eigenvectors().col(0);
  } else if (axes.eigenvalues()[2] > extent) {
    foot.shape = FootShape::kLine;
    axis = axes.eigenvectors().col(2);
  }
  Eigen::Map<Vector3>(foot.middle_m.data()) = middle;
  Eigen::Map<Vector3>(foot.axis.data()) = axis;
}

}  // namespace

std::vector<std::string> foot_names(const hal::Robot& robot) {
  std::vector<std::string> names;
  for (const hal::Foot& foot : robot.feet) names.push_back(foot.site);
  return names;
}

Result<std::vector<FootContact>> find_feet(const hal::Robot& robot, const tandem_kernels& kernels,
                                           std::span<const std::string> names) {
  if (names.empty()) {
    return fail("the robot has no foot to stand on",
                "give each a [[contact.foot]] in " + robot.file + ": its site and its points");
  }
  std::vector<FootContact> feet;
  for (const std::string& name : names) {
    const auto found = std::ranges::find(robot.feet, name, &hal::Foot::site);
    if (found == robot.feet.end()) {
      return fail("the robot has no foot '" + name + "'", suggest(name, foot_names(robot)));
    }
    if (std::ranges::find(feet, name, &FootContact::name) != feet.end()) {
      return fail("the foot '" + name + "' stands twice", "name it once");
    }
    const Result<std::size_t> site = site_index(kernels, name);
    if (!site) return std::unexpected(site.error());
    FootContact& foot =
        feet.emplace_back(FootContact{.name = name, .site = *site, .points_m = found->points_m});
    if (foot.points_m.empty()) foot.points_m.emplace_back();
    describe(foot);
  }
  return feet;
}

GroundFrame ground_under(std::span<const FootContact> feet,
                         std::span<const double> pose) noexcept TANDEM_RT {
  using Eigen::Vector3d;
  using RowMajor3 = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
  const auto in_frame = [&](const FootContact& foot,
                            const std::array<double, 3>& point) -> Vector3d {
    const Eigen::Map<const RowMajor3> R(&pose[12 * foot.site]);
    return R * Eigen::Map<const Vector3d>(point.data()) +
           Eigen::Map<const Vector3d>(&pose[12 * foot.site + 9]);
  };
  GroundFrame ground{Eigen::Matrix3d::Identity(), Vector3d::Zero()};
  Vector3d middle = Vector3d::Zero();
  double count = 0.0;
  for (const FootContact& foot : feet) {
    ground.origin_m += in_frame(foot, foot.middle_m) / static_cast<double>(feet.size());
    for (const auto& point : foot.points_m) {
      middle += in_frame(foot, point);
      count += 1.0;
    }
  }
  middle /= count;
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (const FootContact& foot : feet) {
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
