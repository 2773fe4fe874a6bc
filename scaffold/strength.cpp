// Compares each joint's torque at the posture with limit, current and continuous current of its
// drive.
#include "scaffold/strength.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/counted.hpp"
#include "base/quoting.hpp"

namespace tandem::scaffold {
namespace {

constexpr double kReserve = 0.9;  // of a strength: more than that leaves nothing to balance with

/// Where the joint waits, or stands.
double posed(const NewRobot& robot, const hal::JointConfig& joint) {
  const double at =
      robot.config.postures.front()
          .position_rad[static_cast<std::size_t>(robot.config.joint_index(joint.name))];
  const double short_one = std::round(at * 1e4) / 1e4;
  const bool inside = short_one >= joint.min_position_rad && short_one <= joint.max_position_rad;
  return inside ? short_one : at;
}

/// The command that makes the robot with this joint locked where it is now.
std::string locking(const NewRobot& robot, const hal::JointConfig& joint) {
  const double at = posed(robot, joint);
  const std::string word = at == 0.0 ? joint.name : fmt::format("{}={:.9g}", joint.name, at);
  return fmt::format("`{} --lock {}`", robot.command, shell_word(word));
}

/// Whether other joints hang on it, or follow it, or nothing would be left without it.
bool is_needed(const NewRobot& robot, int joint) {
  const std::vector<model::Joint>& joints = robot.tree.joints;
  for (int j = 0; j < static_cast<int>(joints.size()); ++j) {
    if (j != joint && joints[j].follows() && joints[j].leader == joint) return true;
    for (int body = joints[j].parent; body > 0; body = joints[body - 1].parent)
      if (body - 1 == joint) return true;
  }
  return robot.config.joints.size() < 2;
}

}  // namespace

Diagnostics weak_drives(const NewRobot& robot, const std::vector<double>& torques) {
  Diagnostics weak;
  for (const hal::JointConfig& joint : robot.config.joints) {
    const int j = robot.tree.joint_index(joint.name);
    const hal::ActuatorConfig& drive = robot.config.actuator_of(joint);
    const double needs = std::abs(torques[static_cast<std::size_t>(j)]);
    const double has = hal::lasting_strength_of(joint, drive);
    if (needs <= kReserve * has) continue;
    const bool by_limit = has >= joint.max_torque_Nm;
    const bool slides = robot.tree.joints[j].type == model::JointType::kPrismatic;
    const char* unit = slides ? "N" : "Nm";
    Error report;
    report.message = fmt::format(
        "the posture '{}' takes {:.3g} {} of it against gravity, and {} {:.3g} {}: {}",
        robot.config.postures.front().name, needs, unit,
        by_limit ? "its limit (<limit effort>) is" : "its drive has for long", has, unit,
        needs > has ? "it will sag, or stop with a fault" : "little reserve is left to move");
    report.hint = by_limit ? "correct the effort, or give the joint max_torque_Nm and a stronger "
                             "drive in robot.toml; or choose another posture there"
                           : "give it a stronger drive in robot.toml, or choose another posture "
                             "there";
    report.hint += "; without a motor it stands still by " + locking(robot, joint);
    report.file = robot.tree.file;
    report.line = robot.tree.joints[j].line;
    report.key = "joint " + joint.name;
    weak.push_back(std::move(report));
  }
  return weak;
}

Diagnostics undriven(const NewRobot& robot) {
  Diagnostics found;
  const auto driven = std::ranges::count_if(robot.tree.joints, [](const model::Joint& joint) {
    return !joint.follows() && joint.effort > 0.0 && std::isfinite(joint.effort);
  });
  if (driven == 0) return {};  // exporters write 0 for what they do not know
  for (const hal::JointConfig& joint : robot.config.joints) {
    const int j = robot.tree.joint_index(joint.name);
    const auto own = robot.extras.find(joint.name);
    if (own == robot.extras.end() || !own->second.no_effort) continue;
    Error report;
    report.message = fmt::format(
        "its <limit effort> is 0, and {} {} more: it is driven all the same (guess), "
        "though it may be passive",
        counted(static_cast<std::uint64_t>(driven), "joint"), driven == 1 ? "has" : "have");
    report.hint = "it stands still by " + locking(robot, joint);
    if (!is_needed(robot, j)) {
      report.hint += fmt::format("; it is left out, with what hangs on it, by `{} --drop {}`",
                                 robot.command, shell_word(joint.name));
    }
    report.hint += "; if it is driven, give it its effort";
    report.file = robot.tree.file;
    report.line = robot.tree.joints[j].line;
    report.key = "joint " + joint.name;
    found.push_back(std::move(report));
  }
  return found;
}

}  // namespace tandem::scaffold
