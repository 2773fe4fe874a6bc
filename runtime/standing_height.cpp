#include "runtime/standing_height.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace tandem::runtime {
namespace {

/// Where every body is when the base is the world.
std::vector<model::Placement> placements(const hal::RobotConfig& robot,
                                         const hal::PostureConfig& posture,
                                         const model::Tree& tree) {
  std::vector<model::Placement> bodies(tree.bodies.size());
  for (std::size_t i = 0; i < tree.joints.size(); ++i) {
    const model::Joint& joint = tree.joints[i];
    const int index = robot.joint_index(joint.name);
    const double q = index < 0 ? 0.0 : posture.position_rad[static_cast<std::size_t>(index)];
    model::Placement moved;
    if (joint.type == model::JointType::kPrismatic) {
      moved.p = q * joint.axis;
    } else {
      moved.R = Eigen::AngleAxisd(q, joint.axis).toRotationMatrix();
    }
    bodies[i + 1] = bodies[static_cast<std::size_t>(joint.parent)] * joint.in_parent * moved;
  }
  return bodies;
}

/// A site's frame in its link's, as URDF writes it: roll, pitch, yaw about fixed axes.
model::Placement in_link(const hal::SiteConfig& site) {
  using Eigen::AngleAxisd;
  using Eigen::Vector3d;
  const auto& [roll, pitch, yaw] = site.rpy_rad;
  return {(AngleAxisd(yaw, Vector3d::UnitZ()) * AngleAxisd(pitch, Vector3d::UnitY()) *
           AngleAxisd(roll, Vector3d::UnitX()))
              .toRotationMatrix(),
          Vector3d(site.xyz_m[0], site.xyz_m[1], site.xyz_m[2])};
}

}  // namespace

double standing_height_m(const hal::RobotConfig& robot, const hal::PostureConfig& posture,
                         const model::Tree& tree) {
  const std::vector<model::Placement> bodies = placements(robot, posture, tree);
  double lowest = std::numeric_limits<double>::infinity();
  for (const hal::FootConfig& foot : robot.contact.feet) {
    const auto site = std::ranges::find(robot.model.sites, foot.site, &hal::SiteConfig::name);
    const int index = site == robot.model.sites.end() ? -1 : tree.link_index(site->link);
    if (index < 0) continue;
    const model::Link& link = tree.links[static_cast<std::size_t>(index)];
    const model::Placement sole =
        bodies[static_cast<std::size_t>(link.body)] * link.in_body * in_link(*site);
    for (const auto& [x, y, z] : foot.points_m) {
      lowest = std::min(lowest, (sole.R * Eigen::Vector3d(x, y, z) + sole.p).z());
    }
  }
  return std::isfinite(lowest) ? robot.contact.height_m - lowest : 0.0;
}

}  // namespace tandem::runtime
