// A robot as ROS 2's motion planner MoveIt wants it: a package of files. docs/ros2.md says what is
// in it.
// Layer: scaffold.  Thread: non-RT.
#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/result.hpp"
#include "hal/config/robot_config.hpp"
#include "model/tree.hpp"

namespace tandem::scaffold {

/// Joints that are planned for together, and that one controller leads.
struct MoveItGroup {
  std::string name;         ///< "arm", "left_leg"; of what a limb ends in "arm_end"
  std::vector<int> joints;  ///< in the tree, the root's side first; followers as well
  /// Links at the ends of a chain that does not branch. Empty: it is none, and nobody plans for
  /// places of it.
  std::string base_link, tip_link;
  int carrier = -1;  ///< group at whose end it is; -1: it is at no other's end
  std::string on;    ///< link of that group to which its first joint is fixed
};

/// A group for each limb of the tree (split_limbs()): its chain up to where it branches, and beyond
/// that another one, of a hand for instance. A chain ends at the first site of robot.toml on its
/// last body, else where the links that are fixed to that body begin to branch.
/// @param sites  those of robot.toml
[[nodiscard]] std::vector<MoveItGroup> moveit_groups(const model::Tree& tree,
                                                     const std::vector<hal::SiteConfig>& sites);

/// Pairs of links with collision shapes that are never checked against each other: fixed to each
/// other, or with a joint and at most links without shapes between them.
[[nodiscard]] std::vector<std::pair<std::string, std::string>> neighbours(const model::Tree& tree);

/// The name of the controller that leads `group`: `action`, and before it the group's name where
/// there are several.
[[nodiscard]] std::string moveit_controller(const std::vector<MoveItGroup>& groups,
                                            std::size_t group, const std::string& action);

/// A package of ROS 2, and what was noticed while it was made.
struct MoveItPackage {
  std::string name;  ///< "ur5e_moveit_config"
  std::vector<MoveItGroup> groups;
  std::vector<std::pair<std::string, std::string>> files;  ///< path in the package, text
  Diagnostics warnings;
};

/// @param robot   completed by its description (robot::read_robot())
/// @param urdf    the description's text
/// @param action  name of the controller: each serves ACTION/follow_joint_trajectory
/// Errors: what MoveIt cannot be told: closed loops, `mimic = "independent"`, a floating joint of
/// the description.
[[nodiscard]] Result<MoveItPackage> make_moveit_package(const hal::RobotConfig& robot,
                                                        const model::Tree& tree,
                                                        std::string_view urdf,
                                                        const std::string& action);

}  // namespace tandem::scaffold
