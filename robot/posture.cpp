#include "robot/posture.hpp"

#include <algorithm>

namespace tandem::robot {

std::vector<double> coordinates_at(const hal::RobotConfig& robot, const tandem_kernels& kernels,
                                   const hal::PostureConfig* posture) {
  const std::size_t first = kernels.floating_base != 0 ? 7 : 0;
  std::vector<double> q(kernels.nq, 0.0);
  if (first != 0) q[6] = 1.0;
  for (std::size_t i = 0; i < kernels.joints; ++i) {
    const int driven = robot.joint_index(kernels.joint_names[i]);
    const auto passive =
        std::ranges::find(robot.passive, kernels.joint_names[i], &hal::PassiveConfig::name);
    if (passive != robot.passive.end()) q[first + i] = passive->position_rad;
    if (driven >= 0 && posture != nullptr) {
      q[first + i] = posture->position_rad[static_cast<std::size_t>(driven)];
    }
  }
  return q;
}

std::vector<model::Placement> bodies_in(const hal::RobotConfig& robot,
                                        const hal::PostureConfig& posture,
                                        const model::Tree& tree) {
  std::vector<double> position(tree.joints.size(), 0.0);
  for (std::size_t i = 0; i < posture.position_rad.size(); ++i) {
    const int joint = tree.joint_index(robot.joints[i].name);
    if (joint >= 0) position[static_cast<std::size_t>(joint)] = posture.position_rad[i];
  }
  for (const hal::PassiveConfig& passive : robot.passive) {
    const int joint = tree.joint_index(passive.name);
    if (joint >= 0) position[static_cast<std::size_t>(joint)] = passive.position_rad;
  }
  return model::place_bodies(tree, position);
}

std::optional<StandingHeight> standing(const hal::RobotConfig& robot,
                                       const hal::PostureConfig& posture, const model::Tree& tree) {
  const std::vector<model::Placement> bodies = bodies_in(robot, posture, tree);
  std::optional<StandingHeight> highest;
  for (const hal::Foot& foot : robot.contact.feet) {
    const auto site = std::ranges::find(robot.model.sites, foot.site, &hal::SiteConfig::name);
    const int index = site == robot.model.sites.end() ? -1 : tree.link_index(site->link);
    if (index < 0) continue;
    const model::Link& link = tree.links[static_cast<std::size_t>(index)];
    const model::Placement sole = bodies[static_cast<std::size_t>(link.body)] * link.in_body *
                                  model::placement_of(site->xyz_m, site->rpy_rad);
    for (const auto& [x, y, z] : foot.points_m) {
      const double below = -(sole.R * Eigen::Vector3d(x, y, z) + sole.p).z();
      const double height = robot.contact.height_m + below;
      if (!highest || height > highest->base_height_m) highest = StandingHeight{height, foot.site};
    }
  }
  return highest;
}

}  // namespace tandem::robot
