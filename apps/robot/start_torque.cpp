#include "apps/robot/start_torque.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "apps/robot/ringing_loops.hpp"
#include "model/interpreted_kernels.hpp"
#include "scaffold/posed.hpp"
#include "scaffold/strength.hpp"

namespace tandem::apps {
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
    const std::vector<int> path = scaffold::path_to(robot.tree, body);
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

std::vector<Weak> weak_joints(const RobotFiles& robot, const hal::PostureConfig* posture) {
  auto mechanism = model::make_mechanism(robot.tree, robot.spec, model::Frames::kAsDescribed);
  if (!mechanism) return {};  // is said when the kernels are made
  const model::InterpretedKernels kernels(std::move(*mechanism), robot.config.name);
  const std::vector<double> torques = torques_at_rest(robot.config, *kernels.get(), posture);
  const std::set<int> relieved = joints_to_feet(robot);
  std::vector<Weak> weak;
  for (std::size_t i = 0; i < kernels.get()->joints; ++i) {
    const char* name = kernels.get()->joint_names[i];
    const int index = robot.config.joint_index(name);
    if (index < 0 || relieved.contains(robot.tree.joint_index(name))) continue;
    const hal::JointConfig& joint = robot.config.joints[static_cast<std::size_t>(index)];
    const double has = scaffold::strength_of(joint, robot.config.actuator_of(joint));
    if (std::abs(torques[i]) > has) weak.push_back({&joint, std::abs(torques[i]), has});
  }
  std::ranges::sort(weak, std::ranges::greater(),
                    [](const Weak& one) { return one.needs / one.has; });
  return weak;
}

}  // namespace

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

std::optional<Error> too_weak_at(const RobotFiles& robot, const std::string& posture) {
  const hal::PostureConfig* start = robot.config.posture(posture);
  if (start == nullptr && !posture.empty()) return {};  // has been said elsewhere
  const bool falls = robot.config.model.floating_base && robot.config.contact.feet.empty();
  if (falls || !robot.config.loops.empty()) return {};
  const std::vector<Weak> weak = weak_joints(robot, start);
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

std::optional<Error> upward_gravity(const hal::RobotConfig& robot) {
  if (!(robot.model.gravity_m_s2[2] > 0.0)) return {};
  return Error{
      .message = "gravity points up: z > 0 pulls the robot towards +z, away from the ground",
      .hint = "[0, 0, -9.81] points down; keep it only if the robot hangs from a ceiling",
      .file = robot.file,
      .line = robot.model.gravity_line,
      .key = "model.gravity_m_s2"};
}

/// Of a drive that is given its bearings' friction alone, a common slip: its motor turned many
/// times as fast as its voltage allows.
void warn_of_back_emf(const hal::RobotConfig& robot, Diagnostics& warnings) {
  for (const hal::ActuatorConfig& actuator : robot.actuators) {
    const double per_A = actuator.gear_ratio * actuator.torque_constant_Nm_A;
    const double whole = per_A * per_A / actuator.resistance_ohm;
    if (!(actuator.damping_Nms_rad < 0.5 * whole)) continue;
    warnings.push_back(
        {.message = fmt::format("is {:.3g}, and the back-EMF alone is N^2 K^2 / R = {:.3g}: the "
                                "simulated motor has {:.2g} of its back-EMF, and no friction",
                                actuator.damping_Nms_rad, whole, actuator.damping_Nms_rad / whole),
         .hint = "it is friction and back-EMF together",
         .file = robot.file,
         .line = actuator.damping_line,
         .key = "actuator." + actuator.name + ".damping_Nms_rad"});
  }
}

Diagnostics start_warnings(const RobotFiles& robot, const std::string& posture) {
  Diagnostics warnings;
  warn_of_back_emf(robot.config, warnings);
  if (auto error = upward_gravity(robot.config)) warnings.push_back(std::move(*error));
  if (auto error = too_weak_at(robot, posture)) warnings.push_back(std::move(*error));
  if (auto error = ringing_loops(robot, posture)) warnings.push_back(std::move(*error));
  return warnings;
}

}  // namespace tandem::apps
