// Matches joints by kind of limb, direction of the axis and place in the limb, and scales drive,
// spring and gains by mass times reach.
#include "scaffold/steps.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <map>

#include "scaffold/posture.hpp"
#include "scaffold/strength.hpp"
#include "scaffold/words.hpp"

namespace tandem::scaffold {
namespace {

using Eigen::Vector3d;
using model::Tree;

constexpr double kFastestSpring_rad_s = 3000.0;  // of a link on it: simulated in 250 us steps
constexpr double kMostSag_rad = 0.0175;          // 1 degree: of spring and loop under gravity
constexpr double kLastingShare = 0.8;            // of what a drive gives for long, by gravity
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
  for (double* value : {&a.inertia_kg_m2, &a.damping_Nms_rad, &a.friction_Nm, &a.spring_Nm_rad,
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

/// With which the lightest link on it can still be simulated.
double stiffest_spring(double inertia) {
  return inertia * kFastestSpring_rad_s * kFastestSpring_rad_s;
}

/// A drive of `like` for one joint: which, how many times as large as the rest, how it is named.
struct Choice {
  const hal::JointConfig* joint = nullptr;
  double larger = 1.0;
  bool light = false;  ///< its link is too light for the spring as it is
};

/// Chooses drives by likeness, then by strength.
class Chooser {
 public:
  Chooser(const Like& like, const NewRobot& robot, double scale)
      : like_(like), scale_(scale), ours_(traits_of(robot.tree, robot.limbs, robot.ahead)) {
    const Posed neutral(like.tree, neutral_posture(like.tree));
    std::vector<FoundFoot> feet = find_feet(like.tree, neutral, FeetBy::kName);
    const std::vector<Limb> limbs = split_limbs(like.tree, feet, neutral, Vector3d::UnitX());
    theirs_ = traits_of(like.tree, limbs, Vector3d::UnitX());
  }

  /// @param torque_Nm  that gravity asks for in the first posture
  /// @param sinks      whether the joint has to carry it from the first moment on, on its spring
  [[nodiscard]] Choice choose(int joint, double torque_Nm, bool sinks, double inertia) const {
    Choice choice{.joint = &resembled(joint)};
    if (sinks && sag(*choice.joint, torque_Nm, 1.0) > kMostSag_rad) {
      choice.joint = &firm_enough(*choice.joint, torque_Nm);
    }
    for (const double larger : {1.0, 1.6, 2.4, 4.0, 6.0, 10.0, 16.0, 24.0, 40.0, 60.0, 100.0}) {
      choice.larger = larger;
      const bool firm = !sinks || sag(*choice.joint, torque_Nm, larger) <= kMostSag_rad;
      if (firm && std::abs(torque_Nm) <= kLastingShare * lasting(*choice.joint, larger)) break;
    }
    const hal::ActuatorConfig& drive = like_.config.actuator_of(*choice.joint);
    choice.light =
        drive.order >= 2 && drive.spring_Nm_rad * scale_ * choice.larger > stiffest_spring(inertia);
    return choice;
  }

  /// Joint that is the most alike, of those that have a drive.
  [[nodiscard]] const hal::JointConfig& resembled(int joint) const {
    const auto far = [&](const hal::JointConfig& other) {
      return distance(theirs_[like_.tree.joint_index(other.name)], ours_[joint]);
    };
    return *std::ranges::min_element(like_.config.joints, {}, far);
  }

 private:
  /// How far the joint is from its reference before the integral has begun: its loop and its
  /// spring give way one after the other.
  [[nodiscard]] double sag(const hal::JointConfig& theirs, double torque_Nm, double larger) const {
    const hal::ActuatorConfig& drive = like_.config.actuator_of(theirs);
    double compliance = 1.0 / like_.config.gains_of(theirs).position.gains.kp;
    if (drive.order >= 2) compliance += 1.0 / drive.spring_Nm_rad;
    return std::abs(torque_Nm) * compliance / (scale_ * larger);
  }
  [[nodiscard]] double lasting(const hal::JointConfig& theirs, double larger) const {
    hal::JointConfig unlimited;
    unlimited.max_torque_Nm = std::numeric_limits<double>::infinity();
    return scale_ * larger * hal::lasting_strength_of(unlimited, like_.config.actuator_of(theirs));
  }
  /// The drive that gives way least short of too much; the firmest of all when none is enough.
  [[nodiscard]] const hal::JointConfig& firm_enough(const hal::JointConfig& first,
                                                    double torque_Nm) const {
    const hal::JointConfig* best = &first;
    for (const hal::JointConfig& other : like_.config.joints) {
      const double now = sag(*best, torque_Nm, 1.0), then = sag(other, torque_Nm, 1.0);
      const bool enough = now <= kMostSag_rad;
      if (enough ? then > now && then <= kMostSag_rad : then < now) best = &other;
    }
    return *best;
  }

  const Like& like_;
  double scale_;
  std::vector<Trait> ours_, theirs_;
};

void soften(const std::vector<JointLoad>& loads, DriveSize& drive) {
  double lightest = loads[drive.joints[0]].least_inertia;
  for (const int j : drive.joints) lightest = std::min(lightest, loads[j].least_inertia);
  drive.actuator.spring_Nm_rad = rounded(stiffest_spring(lightest));
  drive.remark += fmt::format("; softened for a link of {:.2g} kg m^2", lightest);
}

std::string name_of(const std::string& theirs, const Choice& choice) {
  std::string name = theirs;
  if (choice.larger > 1.0) name += fmt::format("_x{:g}", choice.larger);
  std::ranges::replace(name, '.', '_');
  return choice.light ? name + "_light" : name;
}

/// Drives that turn are for joints that turn: a slide gets one of its own.
void add_slides(const std::vector<JointLoad>& loads, double period_s, NewRobot& robot) {
  std::vector<DriveSize> sizes = size_drives(robot.tree, robot.limits);
  std::erase_if(sizes, [&](const DriveSize& size) {
    return robot.tree.joints[size.joints[0]].type != model::JointType::kPrismatic;
  });
  std::ranges::move(tune(sizes, loads, {.period_s = period_s}), std::back_inserter(robot.gains));
  std::ranges::move(sizes, std::back_inserter(robot.drives));
}

}  // namespace

double scale_of(const Tree& robot, const Tree& like) {
  return mass_times_reach(robot) / mass_times_reach(like);
}

void take_drives(const Like& like, const std::vector<JointLoad>& loads,
                 const std::vector<double>& torques, double period_s, NewRobot& robot) {
  const double s = scale_of(robot.tree, like.tree);
  const Chooser chooser(like, robot, s);
  const auto in_leg = [&](int joint) {
    return std::ranges::any_of(robot.feet, [&](const FoundFoot& foot) {
      return std::ranges::count(robot.tree.path_to(foot.body), joint) > 0;
    });
  };
  using Names = std::pair<std::string, std::string>;  // of the drive and of its gains
  std::map<Names, std::pair<Choice, std::vector<int>>> groups;
  for (int j = 0; j < static_cast<int>(robot.tree.joints.size()); ++j) {
    const model::Joint& joint = robot.tree.joints[j];
    if (joint.follows() || joint.type == model::JointType::kPrismatic) continue;
    // The hoist lets a leg take its load little by little, so that its integral follows.
    const Choice choice = chooser.choose(j, torques[j], !in_leg(j), loads[j].least_inertia);
    const hal::JointConfig& first = chooser.resembled(j);
    if (first.actuator != choice.joint->actuator || choice.larger > 1.0) {
      robot.remarks.push_back(fmt::format("{} has {} for {}: gravity takes {:.3g} Nm of it.",
                                          joint.name, name_of(choice.joint->actuator, choice),
                                          first.actuator, std::abs(torques[j])));
    }
    auto& group =
        groups[{name_of(choice.joint->actuator, choice), name_of(choice.joint->gains, choice)}];
    group.first = choice;
    group.second.push_back(j);
  }
  for (auto& [names, group] : groups) {
    const auto& [choice, joints] = group;
    const double times = s * choice.larger;
    DriveSize drive{
        scaled(like.config.actuator_of(*choice.joint), times), joints,
        fmt::format("{}'s {} times {:.3g}", like.config.name, choice.joint->actuator, times)};
    drive.actuator.name = names.first;
    if (choice.light) soften(loads, drive);
    GainSet set{scaled(like.config.gains_of(*choice.joint), times), joints,
                fmt::format("{}'s {} times {:.3g}", like.config.name, choice.joint->gains, times)};
    set.gains.name = names.second;
    robot.gains.push_back(std::move(set));
    const auto known = std::ranges::find(robot.drives, names.first,
                                         [](const DriveSize& d) { return d.actuator.name; });
    if (known == robot.drives.end()) {
      robot.drives.push_back(std::move(drive));
    } else {  // the same motor with other gains
      known->joints.insert(known->joints.end(), joints.begin(), joints.end());
    }
  }
  add_slides(loads, period_s, robot);
}

}  // namespace tandem::scaffold
