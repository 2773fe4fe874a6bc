#include "scaffold/like.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>

#include "scaffold/posture.hpp"
#include "scaffold/words.hpp"

namespace tandem::scaffold {
namespace {

using Eigen::Vector3d;
using model::Tree;

constexpr double kFastestSpring_rad_s = 3000.0;  // of a link on it: simulated in 250 us steps
constexpr double kOtherLimb = 10.0;
constexpr double kOtherAxis = 2.0;

/// What makes two robots' joints alike.
struct Trait {
  std::string limb;    ///< "leg", "arm", "torso", "head"
  int axis = 0;        ///< 0 roll, 1 pitch, 2 yaw
  double depth = 0.0;  ///< from 0 at the limb's root to 1 at its end
};

std::vector<Trait> traits_of(const Tree& tree, const std::vector<Limb>& limbs,
                             const Vector3d& ahead) {
  const Posed neutral(tree, neutral_posture(tree));
  std::vector<Trait> traits(tree.joints.size());
  for (const Limb& limb : limbs) {
    for (std::size_t i = 0; i < limb.joints.size(); ++i) {
      const int j = limb.joints[i];
      Trait& trait = traits[j];
      for (const char* kind : {"leg", "arm", "torso", "head"}) {
        if (mentions(limb.name, kind)) trait.limb = kind;
      }
      trait.depth = static_cast<double>(i) / static_cast<double>(limb.joints.size());
      const Vector3d n = neutral.axis(j);
      const Vector3d shares(n.dot(ahead), n.dot(Vector3d::UnitZ().cross(ahead)), n.z());
      shares.cwiseAbs().maxCoeff(&trait.axis);
    }
  }
  return traits;
}

double distance(const Trait& a, const Trait& b) {
  return (a.limb == b.limb ? 0.0 : kOtherLimb) + (a.axis == b.axis ? 0.0 : kOtherAxis) +
         std::abs(a.depth - b.depth);
}

double mass_times_reach(const Tree& tree) {
  double mass = 0.0, most = 0.0;
  std::vector<double> reach(tree.bodies.size(), 0.0);
  for (std::size_t j = 0; j < tree.joints.size(); ++j) {
    reach[j + 1] = reach[tree.joints[j].parent] + tree.joints[j].in_parent.p.norm();
    most = std::max(most, reach[j + 1]);
  }
  for (const model::Body& body : tree.bodies) mass += body.inertia.mass_kg;
  return mass * most;
}

void scale(hal::PidGains& gains, double factor) {
  gains.kp = rounded(gains.kp * factor);
  gains.ki = rounded(gains.ki * factor);
  gains.kd = rounded(gains.kd * factor);
}

/// So many windings side by side: torque, current and inertia grow, voltage and speed stay.
hal::ActuatorConfig scaled(hal::ActuatorConfig a, double s) {
  a.resistance_ohm = rounded(a.resistance_ohm / s);
  a.inductance_H = rounded(a.inductance_H / s);
  for (double* value : {&a.inertia_kg_m2, &a.damping_Nms_rad, &a.spring_Nm_rad,
                        &a.spring_damping_Nms_rad, &a.current_limit_A, &a.continuous_current_A}) {
    *value = rounded(*value * s);
  }
  a.thermal_resistance_K_W = rounded(a.thermal_resistance_K_W / s);
  return a;
}

hal::GainsConfig scaled(hal::GainsConfig g, double s) {
  scale(g.position.gains, s);
  scale(g.velocity.gains, s);
  scale(g.torque.gains, 1.0 / s);   // V/Nm
  scale(g.current.gains, 1.0 / s);  // V/A
  g.stiffness_Nm_rad = rounded(g.stiffness_Nm_rad * s);
  g.damping_Nms_rad = rounded(g.damping_Nms_rad * s);
  return g;
}

/// Of the joints that have a drive the one that is most alike.
const hal::JointConfig& resembled(const Like& like, const std::vector<Trait>& theirs,
                                  const Trait& ours) {
  const auto far = [&](const hal::JointConfig& joint) {
    return distance(theirs[like.tree.joint_index(joint.name)], ours);
  };
  return *std::ranges::min_element(like.config.joints, {}, far);
}

void soften(const std::vector<JointLoad>& loads, DriveSize& drive) {
  double lightest = loads[drive.joints[0]].least_inertia;
  for (const int j : drive.joints) lightest = std::min(lightest, loads[j].least_inertia);
  const double most = lightest * kFastestSpring_rad_s * kFastestSpring_rad_s;
  if (drive.actuator.order < 2 || drive.actuator.spring_Nm_rad <= most) return;
  drive.actuator.spring_Nm_rad = rounded(most);
  drive.remark += fmt::format("; softened for a link of {:.2g} kg m^2", lightest);
}

}  // namespace

double scale_of(const Tree& robot, const Tree& like) {
  return mass_times_reach(robot) / mass_times_reach(like);
}

void take_drives(const Like& like, const std::vector<JointLoad>& loads, NewRobot& robot) {
  const double s = scale_of(robot.tree, like.tree);
  const Posed neutral(like.tree, neutral_posture(like.tree));
  std::vector<Foot> feet = find_feet(like.tree, {}, neutral, FeetBy::kName);
  const std::vector<Limb> limbs = split_limbs(like.tree, feet, neutral, Vector3d::UnitX());
  const std::vector<Trait> theirs = traits_of(like.tree, limbs, Vector3d::UnitX());
  const std::vector<Trait> ours = traits_of(robot.tree, robot.limbs, robot.ahead);
  std::map<std::pair<std::string, std::string>, std::vector<int>> groups;
  for (std::size_t j = 0; j < ours.size(); ++j) {
    if (robot.tree.joints[j].follows()) continue;
    const hal::JointConfig& joint = resembled(like, theirs, ours[j]);
    groups[{joint.actuator, joint.gains}].push_back(static_cast<int>(j));
  }
  for (const auto& [key, joints] : groups) {
    hal::JointConfig named;
    named.actuator = key.first;
    named.gains = key.second;
    const std::string from = fmt::format("{}'s {} times {:.3g}", like.config.name, key.first, s);
    DriveSize drive{scaled(like.config.actuator_of(named), s), joints, from};
    soften(loads, drive);
    GainSet set{scaled(like.config.gains_of(named), s), joints,
                fmt::format("{}'s {} times {:.3g}", like.config.name, key.second, s)};
    const bool known = std::ranges::any_of(
        robot.drives, [&](const DriveSize& d) { return d.actuator.name == drive.actuator.name; });
    if (known) {  // the same motor with other gains
      for (DriveSize& d : robot.drives) {
        if (d.actuator.name == key.first)
          d.joints.insert(d.joints.end(), joints.begin(), joints.end());
      }
    } else {
      robot.drives.push_back(std::move(drive));
    }
    robot.gains.push_back(std::move(set));
  }
}

}  // namespace tandem::scaffold
