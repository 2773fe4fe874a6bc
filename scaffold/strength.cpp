// Compares each joint's torque at the posture with limit, current and continuous current of its
// drive.
#include "scaffold/strength.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace tandem::scaffold {
namespace {

constexpr double kReserve = 0.9;  // of a strength: more than that leaves nothing to balance with

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
    report.file = robot.tree.file;
    report.line = robot.tree.joints[j].line;
    report.key = "joint " + joint.name;
    weak.push_back(std::move(report));
  }
  return weak;
}

}  // namespace tandem::scaffold
