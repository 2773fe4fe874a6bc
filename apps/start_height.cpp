#include "apps/start_height.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "model/dynamics.hpp"

namespace tandem::apps {
namespace {

constexpr double kTolerated_m = 0.005;

/// Poses of the sites, 12 numbers each, as model/kernels.h says.
std::vector<double> site_poses(const RobotFiles& robot, const model::Mechanism& m,
                               const hal::PostureConfig& posture) {
  std::vector<double> q(static_cast<std::size_t>(m.nq()), 0.0);
  if (m.floating_base) {
    q[2] = posture.base_height_m;
    q[6] = 1.0;
  }
  for (std::size_t i = 0; i < posture.position_rad.size(); ++i) {
    const int joint = robot.tree.joint_index(robot.config.joints[i].name);
    if (joint >= 0) q[static_cast<std::size_t>(m.q_index(joint))] = posture.position_rad[i];
  }
  const std::vector<double> rest(static_cast<std::size_t>(m.nv()), 0.0);
  return model::evaluate_kernel(model::Kernel::kSiteMotion, m, {q, rest, rest}).front();
}

struct Lowest {
  double height_m = std::numeric_limits<double>::infinity();  ///< above the ground
  std::string site;
};

Lowest lowest_point(const hal::ContactConfig& contact, const model::Mechanism& m,
                    const std::vector<double>& poses) {
  Lowest lowest;
  for (const hal::FootConfig& foot : contact.feet) {
    const auto found = std::ranges::find(m.site_names, foot.site);
    if (found == m.site_names.end()) continue;
    const double* pose = poses.data() + 12 * (found - m.site_names.begin());
    for (const std::array<double, 3>& p : foot.points_m) {
      const double z = pose[11] + pose[6] * p[0] + pose[7] * p[1] + pose[8] * p[2];
      if (z - contact.height_m < lowest.height_m) lowest = {z - contact.height_m, foot.site};
    }
  }
  return lowest;
}

/// How far the robot's weight presses its soles into the ground.
double pressed_in(const hal::ContactConfig& contact, const model::Mechanism& m) {
  std::size_t points = 0;
  for (const hal::FootConfig& foot : contact.feet) points += foot.points_m.size();
  return m.mass_kg * std::hypot(m.gravity[0], m.gravity[1], m.gravity[2]) /
         (contact.stiffness_N_m * static_cast<double>(points));
}

}  // namespace

std::optional<Error> start_in_ground(const RobotFiles& robot, const std::string& posture) {
  const hal::ContactConfig& contact = robot.config.contact;
  if (contact.feet.empty()) return {};
  const hal::PostureConfig zero{};
  const hal::PostureConfig* start = posture.empty() ? &zero : robot.config.posture(posture);
  const auto m = model::make_mechanism(robot.tree, robot.spec);
  if (start == nullptr || !m) return {};  // has been said elsewhere
  const Lowest lowest = lowest_point(contact, *m, site_poses(robot, *m, *start));
  const double depth_m = -lowest.height_m;
  if (!(depth_m > std::max(kTolerated_m, 2.0 * pressed_in(contact, *m)))) return {};
  Error error;
  error.message = fmt::format(
      "{} starts {:.4f} m inside the ground, with the foot '{}'",
      posture.empty() ? "the robot with every joint at 0" : "the posture '" + posture + "'",
      depth_m, lowest.site);
  error.hint = m->floating_base
                   ? fmt::format("base_height_m = {:.4f} lets it touch; more lets it hang above",
                                 start->base_height_m + depth_m)
                   : "move its joints, or lower height_m of [contact]";
  error.file = robot.config.file;
  error.line = start->line;
  error.key = posture.empty() ? "contact.height_m"
                              : "posture." + posture + (m->floating_base ? ".base_height_m" : "");
  return error;
}

}  // namespace tandem::apps
