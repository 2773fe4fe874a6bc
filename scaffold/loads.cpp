// Smallest and largest inertia and gravity torque of each joint over 200 postures of Halton's
// series, and limits where the description has no usable ones.
#include "scaffold/loads.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "scaffold/posture.hpp"

namespace tandem::scaffold {
namespace {

using Eigen::Vector3d;
using model::Tree;

constexpr int kPostures = 200;
constexpr double kLever = 0.3;             // of a leg's length: from a bent knee to the load's line
constexpr double kLoadMargin = 2.0;        // of a drive over gravity at its worst
constexpr double kAcceleration = 10.0;     // [rad/s^2 or m/s^2] on top of it, in every posture
constexpr double kNeighbour = 0.25;        // of what the stronger neighbour has
constexpr double kLeastEffort = 0.5;       // [Nm or N]
constexpr double kAbsurdEffort = 10.0;     // times the robot's weight at its reach
constexpr double kAbsurdVelocity = 100.0;  // [rad/s or m/s]
constexpr double kVelocity_rad_s = 5.0;    // without a limit
constexpr double kVelocity_m_s = 0.5;

/// The next of 0.5, 0.8, 1.2, 2, 3, 5, 8, 12, …: so that a left and a right joint, whose loads
/// differ by chance, get the same.
double next_size(double effort) {
  for (double decade = kLeastEffort;; decade *= 10.0) {
    for (const double step : {1.0, 1.6, 2.4, 4.0, 6.0}) {
      if (effort <= step * decade * (1.0 + 1e-9)) return step * decade;
    }
  }
}

/// Largest distance between a joint's origin and the root.
double reach_of(const Tree& tree) {
  double most = 0.1;
  std::vector<double> reach(tree.bodies.size(), 0.0);
  for (std::size_t j = 0; j < tree.joints.size(); ++j) {
    reach[j + 1] = reach[tree.joints[j].parent] + tree.joints[j].in_parent.p.norm();
    most = std::max(most, reach[j + 1] + tree.bodies[j + 1].inertia.com_m.norm());
  }
  return most;
}

bool slides(const model::Joint& joint) { return joint.type == model::JointType::kPrismatic; }

/// No guess below kNeighbour of what a joint before or behind it has that moves as it does: from
/// the tips to the root, and out again.
void raise_to_neighbours(const Tree& tree, std::vector<JointLimits>& limits) {
  const auto raise = [&](int joint, int other) {
    const bool alike = slides(tree.joints[joint]) == slides(tree.joints[other]);
    if (!limits[joint].effort_guessed || !alike || tree.joints[other].follows()) return;
    limits[joint].effort = std::max(limits[joint].effort, kNeighbour * limits[other].effort);
  };
  const int count = static_cast<int>(limits.size());
  for (int j = count; j-- > 0;) {
    if (tree.joints[j].parent > 0) raise(tree.joints[j].parent - 1, j);
  }
  for (int j = 0; j < count; ++j) {
    if (tree.joints[j].parent > 0) raise(j, tree.joints[j].parent - 1);
  }
}

/// A leg whose foot stands swings the robot above it: its share of the whole, as a point mass.
void add_stance(const Tree& tree, const std::vector<FoundFoot>& feet, const Posed& stance,
                std::vector<JointLoad>& loads) {
  const double share_kg = stance.whole().mass_kg / static_cast<double>(feet.size());
  for (const FoundFoot& foot : feet) {
    const std::vector<int> path = tree.path_to(foot.body);
    const Vector3d sole = (stance.link(foot.link) * foot.sole_in_link).p;
    const double length = (stance.origin(path.front()) - sole).norm();
    const double height = (stance.whole().com_m - sole).norm();
    for (const int j : path) {
      if (stance.slides(j)) continue;
      loads[j].sway_inertia = share_kg * height * height;
      loads[j].sway_Nm_rad = share_kg * kGravity_m_s2 * height;
      const double lever = (stance.whole().com_m - stance.origin(j)).norm();
      loads[j].most_inertia = std::max(loads[j].most_inertia, share_kg * lever * lever);
      loads[j].fall_Nm_rad = share_kg * kGravity_m_s2 * lever;
      loads[j].gravity_Nm =
          std::max(loads[j].gravity_Nm, 2.0 * share_kg * kGravity_m_s2 * kLever * length);
    }
  }
}

}  // namespace

std::vector<JointLoad> loads_of(const Tree& tree, const std::vector<FoundFoot>& feet,
                                const Posed* stance) {
  const Bounds bounds = bounds_of(tree);
  std::vector<JointLoad> loads(tree.joints.size());
  for (int sample = 0; sample < kPostures; ++sample) {
    Eigen::VectorXd q(bounds.lower.size());
    for (Eigen::Index j = 0; j < q.size(); ++j) {
      q[j] = bounds.lower[j] +
             (bounds.upper[j] - bounds.lower[j]) * halton(sample, static_cast<int>(j));
    }
    const Posed posed(tree, q);
    for (std::size_t j = 0; j < loads.size(); ++j) {
      const int joint = static_cast<int>(j);
      if (tree.joints[j].follows()) continue;
      const double inertia = posed.inertia(joint);
      JointLoad& load = loads[j];
      load.least_inertia = sample == 0 ? inertia : std::min(load.least_inertia, inertia);
      load.most_inertia = load.free_inertia = std::max(load.most_inertia, inertia);
      load.gravity_Nm = std::max(load.gravity_Nm, std::abs(posed.gravity_load(joint)));
    }
  }
  if (stance != nullptr) add_stance(tree, feet, *stance, loads);
  return loads;
}

std::vector<double> torques_at(const Tree& tree, const std::vector<FoundFoot>& feet,
                               const Posed& posed) {
  const auto n = static_cast<Eigen::Index>(tree.joints.size());
  Eigen::VectorXd torque = Eigen::VectorXd::Zero(n);
  for (Eigen::Index j = 0; j < n; ++j) {
    if (!tree.joints[j].follows()) torque[j] = posed.gravity_load(static_cast<int>(j));
  }
  for (const FoundFoot& foot : feet) {
    const double share_N = posed.whole().mass_kg * kGravity_m_s2 / static_cast<double>(feet.size());
    const Vector3d sole = (posed.link(foot.link) * foot.sole_in_link).p;
    torque -= share_N * posed.point_jacobian(foot.body, sole).row(2).transpose();
  }
  return {torque.begin(), torque.end()};
}

std::vector<JointLimits> limits_of(const Tree& tree, const std::vector<JointLoad>& loads) {
  double mass = 0.0;
  for (const model::Body& body : tree.bodies) mass += body.inertia.mass_kg;
  const double weight_at_reach = mass * kGravity_m_s2 * std::max(reach_of(tree), 1.0);
  std::vector<JointLimits> limits;
  for (std::size_t j = 0; j < tree.joints.size(); ++j) {
    const model::Joint& joint = tree.joints[j];
    JointLimits limit;
    limit.effort = joint.effort;
    limit.velocity = joint.velocity;
    if (!(joint.effort > 0.0 && joint.effort < kAbsurdEffort * weight_at_reach)) {
      limit.effort = kLoadMargin * loads[j].gravity_Nm + kAcceleration * loads[j].free_inertia;
      limit.effort_guessed = true;
    }
    if (!(joint.velocity > 0.0 && joint.velocity < kAbsurdVelocity)) {
      limit.velocity = slides(joint) ? kVelocity_m_s : kVelocity_rad_s;
      limit.velocity_guessed = true;
    }
    limit.range = position_range(joint);
    limits.push_back(limit);
  }
  raise_to_neighbours(tree, limits);
  for (JointLimits& limit : limits) {
    if (limit.effort_guessed) limit.effort = next_size(limit.effort);
  }
  return limits;
}

std::string replaced_limits(const Tree& tree, const std::vector<JointLimits>& limits) {
  std::string first;
  std::size_t count = 0;
  for (std::size_t j = 0; j < limits.size(); ++j) {
    const model::Joint& joint = tree.joints[j];
    if (joint.follows()) continue;
    std::vector<std::string> what;
    const bool slid = slides(joint);
    if (limits[j].effort_guessed && joint.effort > 0.0 && std::isfinite(joint.effort))
      what.push_back(fmt::format("an effort of {:g} {}", joint.effort, slid ? "N" : "Nm"));
    if (limits[j].velocity_guessed && joint.velocity > 0.0 && std::isfinite(joint.velocity))
      what.push_back(fmt::format("a speed of {:g} {}", joint.velocity, slid ? "m/s" : "rad/s"));
    if (what.empty()) continue;
    if (count++ == 0) {
      first = fmt::format("Limits are guessed: {} {} (joint {})", fmt::join(what, " and "),
                          what.size() == 1 ? "is none" : "are none", joint.name);
    }
  }
  if (count == 0) return {};
  return first + (count == 1 ? "." : fmt::format(", and so with {} more.", count - 1));
}

}  // namespace tandem::scaffold
