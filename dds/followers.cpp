#include "dds/followers.hpp"

namespace tandem::dds {

std::vector<hal::Follower> followers_of(const hal::RobotConfig& robot, const model::Tree& tree) {
  std::vector<hal::Follower> all;
  for (const model::Joint& joint : tree.joints) {
    if (!joint.follows()) continue;
    const int leader = robot.joint_index(tree.joints[static_cast<std::size_t>(joint.leader)].name);
    if (leader < 0) continue;  // it has no drive either
    all.push_back({joint.name, static_cast<std::size_t>(leader), joint.multiplier, joint.offset});
  }
  return all;
}

}  // namespace tandem::dds
