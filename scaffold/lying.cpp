// A robot whose legs do not lie along -z of its root, and what to do about it.
#include "scaffold/steps.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <cmath>

namespace tandem::scaffold {
namespace {

/// What turns the root so that `down` points down and `ahead` along x, as a URDF has it; both are
/// axes of the root.
std::string upright_rpy(const Eigen::Vector3d& down, const Eigen::Vector3d& ahead) {
  Eigen::Matrix3d R;  // its rows: the new axes in the old ones
  R << ahead.transpose(), ahead.cross(down).transpose(), -down.transpose();
  const bool steep = std::abs(R(2, 0)) > 0.5;
  const double pitch = std::asin(-R(2, 0));
  const double yaw = steep ? 0.0 : std::atan2(R(1, 0), R(0, 0));
  const double roll = steep ? std::atan2(pitch * R(0, 1), R(1, 1)) : std::atan2(R(2, 1), R(2, 2));
  return fmt::format("{:.10g} {:.10g} {:.10g}", roll + 0.0, pitch + 0.0, yaw + 0.0);
}

/// "+x" of the root's axes.
std::string axis_name(const Eigen::Vector3d& axis) {
  Eigen::Index index = 0;
  axis.cwiseAbs().maxCoeff(&index);
  return std::string(axis[index] > 0.0 ? "+" : "-") + "xyz"[index];
}

}  // namespace

Error lies(const std::string& root, const Eigen::Vector3d& down, const Eigen::Vector3d& ahead) {
  return {.message = fmt::format("the legs lie along {} of the root '{}' and not along -z: the "
                                 "robot would lie on the ground",
                                 axis_name(down), root),
          .hint = fmt::format(
              "put a root with z up before it: <link name=\"upright\"/> <joint "
              "name=\"to_upright\" type=\"fixed\"><origin rpy=\"{}\"/><parent "
              "link=\"upright\"/><child link=\"{}\"/></joint>. Its front is then its {}, as joints "
              "and feet suggest; the last number turns it. Or give --base floating to take it as "
              "it is, --base fixed to do without feet",
              upright_rpy(down, ahead), root, axis_name(ahead)),
          .file = {},
          .line = 0,
          .key = {}};
}

}  // namespace tandem::scaffold
