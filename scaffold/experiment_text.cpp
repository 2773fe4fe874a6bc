// hold.toml and move.toml of a new robot.
#include <fmt/format.h>

#include <algorithm>
#include <span>

#include "scaffold/new_robot.hpp"
#include "scaffold/toml_words.hpp"

namespace tandem::scaffold {
namespace {

constexpr double kLikeDamping_Nms_rad = 12.0;  // what COMAN's experiments add on soft springs

std::string head(const NewRobot& robot, const std::string& what, double duration_s) {
  return fmt::format("# {}\nrobot = \"robot.toml\"\nposture = {}\nduration_s = {:.1f}\nseed = 1\n",
                     what, quoted_text(robot.config.postures[0].name), duration_s);
}

/// A sentence, true for this robot.
std::string what_moves(const NewRobot& robot) {
  const Move& move = robot.move;
  if (!(robot.stands_m > 0.0)) {
    return move.swings ? "Swings its joints about their posture."
                       : "Stays in its posture: the drives are too weak to move out of it.";
  }
  const std::string squats =
      move.squat_m > 0.0 ? fmt::format("Squats {:.0f} mm twice", 1e3 * move.squat_m) : "";
  if (squats.empty()) {
    return move.swings ? "Swings the joints that are in no leg. The legs' limits leave no squat."
                       : "Stays as it stands: limits of the legs leave no squat.";
  }
  return squats + (move.swings ? " and swings the joints that are in no leg." : ".");
}

/// A comment that names the joints that move less than the others; empty when all move alike.
std::string held_back(const Move& move) {
  if (move.held_back.empty()) return "";
  std::vector<std::string> names;
  for (const auto& [joint, swing] : move.held_back) {
    names.push_back(swing > 0.0 ? fmt::format("{} {:.3f}", joint, swing) : joint + " not at all");
  }
  return fmt::format("# Weak drives, the floor or the legs hold back [rad or m]: {}.\n",
                     fmt::join(names, ", "));
}

/// The two joints that move most; of those that move alike the first.
std::vector<std::string> widest(const NewRobot& robot) {
  std::vector<std::pair<double, std::string>> found;
  for (std::size_t j = 0; j < robot.config.joints.size(); ++j) {
    double least = robot.move.points[0].position_rad[j], most = least;
    for (const WayPoint& point : robot.move.points) {
      least = std::min(least, point.position_rad[j]);
      most = std::max(most, point.position_rad[j]);
    }
    found.emplace_back(most - least, robot.config.joints[j].name);
  }
  constexpr double kAlike = 1e-6;
  std::ranges::stable_sort(found,
                           [](const auto& a, const auto& b) { return a.first > b.first + kAlike; });
  std::vector<std::string> names;
  for (const auto& one : std::span(found).first(std::min<std::size_t>(2, found.size()))) {
    names.push_back(one.second);
  }
  return names;
}

std::string report(const std::vector<std::string>& joints) {
  return fmt::format("\n[report]\nposition_of = {}\ntorque_of = {}\n", quoted_text(joints.front()),
                     quoted_text(joints.back()));
}

/// Quoted, in the order of [[joint]].
std::vector<std::string> legs_joints(const NewRobot& robot) {
  std::vector<std::string> names;
  for (const hal::JointConfig& joint : robot.config.joints) {
    for (const Limb& limb : robot.limbs) {
      const bool its = std::ranges::any_of(limb.joints, [&](int index) {
        return robot.tree.joints[static_cast<std::size_t>(index)].name == joint.name;
      });
      if (limb.foot >= 0 && its) names.push_back(quoted_text(joint.name));
    }
  }
  return names;
}

}  // namespace

std::string hold_text(const NewRobot& robot) {
  const bool stands = robot.stands_m > 0.0;
  std::string text =
      head(robot, stands ? "Stands on its feet." : "Holds the posture it starts in.", 10.0);
  text += "\n[[controller]]\nplugin = \"hold\"\n";
  if (stands && !robot.like.empty()) {  // light links, of arms and heads, would ring with it
    text += fmt::format(
        "[controller.parameters]\njoints = [{}]  # the legs'; all others are held as they are\n"
        "link_damping_Nms_rad = {:.3g}  # guess: the links swing on their springs\n",
        fmt::join(legs_joints(robot), ", "), rounded(kLikeDamping_Nms_rad * robot.scale));
  }
  return text + report(robot.report);
}

std::string move_text(const NewRobot& robot) {
  std::string text = head(robot, what_moves(robot), robot.move.points.back().time_s + 1.0);
  text.insert(text.find('\n') + 1, held_back(robot.move));
  text += "\n[[controller]]\nplugin = \"joint_trajectory\"\n";
  std::vector<std::string> names;
  for (const hal::JointConfig& joint : robot.config.joints)
    names.push_back(quoted_text(joint.name));
  text += fmt::format("[controller.parameters]\njoints = [{}]\n", fmt::join(names, ", "));
  for (const WayPoint& point : robot.move.points) {
    text += fmt::format(
        "\n[[controller.parameters.waypoint]]\ntime_s = {:.1f}\nposition_rad = [{:.4f}]\n",
        point.time_s, fmt::join(point.position_rad, ", "));
  }
  return text + report(robot.move.squat_m > 0.0 ? robot.report : widest(robot));
}

}  // namespace tandem::scaffold
