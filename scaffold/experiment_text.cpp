// hold.toml and move.toml of a new robot.
#include <fmt/format.h>

#include "scaffold/new_robot.hpp"
#include "scaffold/toml_words.hpp"

namespace tandem::scaffold {
namespace {

constexpr double kLikeDamping_Nms_rad = 12.0;  // what COMAN's experiments add on soft springs

std::string head(const NewRobot& robot, const std::string& what, double duration_s) {
  return fmt::format("# {}\nrobot = \"robot.toml\"\nposture = {}\nduration_s = {:.1f}\nseed = 1\n",
                     what, toml_string(robot.config.postures[0].name), duration_s);
}

/// A sentence, true for this robot.
std::string what_moves(const NewRobot& robot) {
  const Move& move = robot.move;
  if (!(robot.stands_m > 0.0)) {
    return move.swings ? "Swings its joints about their posture, as far as the drives bear it."
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

std::string report(const NewRobot& robot) {
  std::string text = "\n[report]\n";
  text += fmt::format("hip = {}\n", toml_string(robot.report.front()));
  if (robot.report.size() > 1) text += fmt::format("knee = {}\n", toml_string(robot.report[1]));
  return text;
}

}  // namespace

std::string hold_text(const NewRobot& robot) {
  const bool stands = robot.stands_m > 0.0;
  std::string text =
      head(robot, stands ? "Stands on its feet." : "Holds the posture it starts in.", 10.0);
  text += "\n[[controller]]\nplugin = \"hold\"\n";
  if (!robot.like.empty()) {
    text += fmt::format(
        "[controller.parameters]\nlink_damping_Nms_rad = {:.3g}  # guess: the links swing on their "
        "springs\n",
        rounded(kLikeDamping_Nms_rad * robot.scale));
  }
  return text + report(robot);
}

std::string move_text(const NewRobot& robot) {
  std::string text = head(robot, what_moves(robot), robot.move.points.back().time_s + 1.0);
  text += "\n[[controller]]\nplugin = \"joint_trajectory\"\n";
  std::vector<std::string> names;
  for (const hal::JointConfig& joint : robot.config.joints) names.push_back(toml_string(joint.name));
  text += fmt::format("[controller.parameters]\njoints = [{}]\n", fmt::join(names, ", "));
  for (const WayPoint& point : robot.move.points) {
    text += fmt::format(
        "\n[[controller.parameters.waypoint]]\ntime_s = {:.1f}\nposition_rad = [{:.4f}]\n",
        point.time_s, fmt::join(point.position_rad, ", "));
  }
  return text + report(robot);
}

}  // namespace tandem::scaffold
