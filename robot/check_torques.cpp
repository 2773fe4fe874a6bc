// Whether the joints can carry the robot where it starts.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "hal/config/strength.hpp"
#include "robot/check_rows.hpp"
#include "robot/posture.hpp"

namespace tandem::robot {
namespace {

struct Weak {
  const hal::JointConfig* joint;
  double needs = 0.0;  ///< [Nm or N]
  double has = 0.0;
};

/// The joints that the ground may relieve.
std::set<int> joints_to_feet(const RobotFiles& robot) {
  std::set<int> joints;
  for (const hal::Foot& foot : robot.config.contact.feet) {
    const auto site =
        std::ranges::find(robot.config.model.sites, foot.site, &hal::SiteConfig::name);
    const int link =
        site == robot.config.model.sites.end() ? -1 : robot.tree.link_index(site->link);
    if (link < 0) continue;
    const int body = robot.tree.links[static_cast<std::size_t>(link)].body;
    const std::vector<int> path = robot.tree.path_to(body);
    joints.insert(path.begin(), path.end());
  }
  return joints;
}

/// What each of the model's coordinates must give at rest, the base held upright.
std::vector<double> torques_at_rest(const hal::RobotConfig& robot, const tandem_kernels& kernels,
                                    const hal::PostureConfig* posture) {
  const std::vector<double> q = coordinates_at(robot, kernels, posture);
  std::vector<double> v(kernels.nv, 0.0), h(kernels.nv, 0.0);
  kernels.bias(q.data(), v.data(), h.data());
  return {h.end() - kernels.joints, h.end()};
}

std::vector<Weak> weak_joints(const RobotFiles& robot, const tandem_kernels& kernels,
                              const hal::PostureConfig* posture) {
  const std::vector<double> torques = torques_at_rest(robot.config, kernels, posture);
  const std::set<int> relieved = joints_to_feet(robot);
  std::vector<Weak> weak;
  for (std::size_t i = 0; i < kernels.joints; ++i) {
    const char* name = kernels.joint_names[i];
    const int index = robot.config.joint_index(name);
    if (index < 0 || relieved.contains(robot.tree.joint_index(name))) continue;
    const hal::JointConfig& joint = robot.config.joints[static_cast<std::size_t>(index)];
    const double has = hal::strength_of(joint, robot.config.actuator_of(joint));
    if (std::abs(torques[i]) > has) weak.push_back({&joint, std::abs(torques[i]), has});
  }
  std::ranges::sort(weak, std::ranges::greater(),
                    [](const Weak& one) { return one.needs / one.has; });
  return weak;
}

std::optional<Error> too_weak_at(const RobotFiles& robot, const tandem_kernels& kernels,
                                 const std::string& posture) {
  const hal::PostureConfig* start = robot.config.posture(posture);
  if (start == nullptr && !posture.empty()) return {};  // has been said elsewhere
  const bool falls = robot.config.model.floating_base && robot.config.contact.feet.empty();
  if (falls || !robot.config.loops.empty()) return {};
  const std::vector<Weak> weak = weak_joints(robot, kernels, start);
  if (weak.empty()) return {};
  const Weak& worst = weak.front();
  const bool by_limit = worst.has >= worst.joint->max_torque_Nm;
  Error error;
  error.message = fmt::format(
      "gravity asks {:.3g} {} of it {}, and it can give {:.3g}: it will sag, or stop with a "
      "fault{}",
      worst.needs, worst.joint->slides ? "N" : "Nm",
      posture.empty() ? "with every joint at 0" : "in the posture '" + posture + "'", worst.has,
      weak.size() == 1 ? "" : fmt::format("; so will {} more", weak.size() - 1));
  error.hint = fmt::format("raise {}, or start in another posture",
                           by_limit ? "max_torque_Nm" : "its drive's current or voltage");
  error.file = robot.config.file;
  error.line = worst.joint->line;
  error.key = "joint." + worst.joint->name + (by_limit ? ".max_torque_Nm" : "");
  return error;
}

}  // namespace

void check_torques(const CheckedRobot& s, Findings& findings) {
  for (const std::string& posture : s.use.postures) {
    if (auto warning = too_weak_at(s.robot, s.kernels, posture)) findings.warn(std::move(*warning));
  }
}

}  // namespace tandem::robot
