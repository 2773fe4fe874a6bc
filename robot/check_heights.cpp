// Whether a posture starts inside the ground.
#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "hal/sim/link_points.hpp"
#include "robot/check_rows.hpp"
#include "robot/posture.hpp"

namespace tandem::robot {
namespace {

constexpr double kHighest = 10.0;  // of the height at which it touches: more is a slip of units
constexpr double kTolerated_m = 0.005;

/// How far the robot's weight presses its soles into the ground.
double pressed_in(const RobotFiles& robot) {
  const hal::ContactConfig& contact = robot.config.contact;
  std::size_t points = 0;
  for (const hal::Foot& foot : contact.feet) points += foot.points_m.size();
  double mass_kg = 0.0;
  for (const model::Body& body : robot.tree.bodies) mass_kg += body.inertia.mass_kg;
  const auto& [x, y, z] = robot.spec.gravity_m_s2;
  return mass_kg * std::hypot(x, y, z) / (contact.stiffness_N_m * static_cast<double>(points));
}

std::optional<Error> wrong_start_height(const RobotFiles& robot, const std::string& posture) {
  const hal::PostureConfig zero{};
  const hal::PostureConfig* start = posture.empty() ? &zero : robot.config.posture(posture);
  if (start == nullptr) return {};  // has been said elsewhere
  const auto touching = standing(robot.config, *start, robot.tree);
  if (!touching) return {};
  const bool floats = robot.tree.floating_base;
  const double depth_m = touching->base_height_m - (floats ? start->base_height_m : 0.0);
  Error error;
  error.file = robot.config.file;
  error.line = start->line;
  error.key = posture.empty() ? "contact.height_m"
                              : "posture." + posture + (floats ? ".base_height_m" : "");
  if (floats && -depth_m > kHighest * std::max(touching->base_height_m, 0.1)) {
    error.message =
        fmt::format("the posture '{}' starts {:.1f} m above the ground", posture, -depth_m);
    error.hint = fmt::format("base_height_m = {:.4f} lets it touch", touching->base_height_m);
    return error;
  }
  if (!(depth_m > std::max(kTolerated_m, 2.0 * pressed_in(robot)))) return {};
  error.message = fmt::format(
      "{} starts {:.4f} m inside the ground, with the foot '{}'",
      posture.empty() ? "the robot with every joint at 0" : "the posture '" + posture + "'",
      depth_m, touching->foot);
  error.hint = floats ? fmt::format("base_height_m = {:.4f} lets it touch; more lets it hang above",
                                    touching->base_height_m)
                      : "move its joints, or lower height_m of [contact]";
  return error;
}

Diagnostics buried_links(const RobotFiles& robot, const std::string& posture) {
  Diagnostics warnings;
  const hal::PostureConfig zero{};
  const hal::PostureConfig* start = posture.empty() ? &zero : robot.config.posture(posture);
  if (start == nullptr || !(robot.config.contact.stiffness_N_m > 0.0)) return warnings;
  const auto bodies = bodies_in(robot.config, *start, robot.tree);
  const double base_m = robot.tree.floating_base ? start->base_height_m : 0.0;
  for (const sim::LinkPoints& points : sim::link_points(robot.config, robot.tree)) {
    if (points.guessed) continue;  // nobody wrote it
    const model::Link& link = robot.tree.links[points.link];
    const model::Placement& body = bodies[static_cast<std::size_t>(link.body)];
    double depth_m = 0.0;
    for (const Eigen::Vector3d& point : points.in_body_m) {
      const double height_m = base_m + (body.R * point + body.p).z();
      depth_m = std::max(depth_m, robot.config.contact.height_m - height_m);
    }
    if (!(depth_m > 0.0)) continue;
    Error warning;
    warning.file = robot.config.file;
    warning.line = start->line;
    warning.key = posture.empty() ? "contact.height_m" : "posture." + posture;
    warning.message = fmt::format(
        "the link '{}' starts {:.4f} m inside the ground: what is inside does not touch it in "
        "this run",
        link.name, depth_m);
    warning.hint = "move its joints, raise the base, or correct its <collision>";
    warnings.push_back(std::move(warning));
  }
  return warnings;
}

}  // namespace

void check_start_heights(const CheckedRobot& s, Findings& findings) {
  for (const std::string& posture : s.use.postures) {
    auto error = wrong_start_height(s.robot, posture);
    if (!error) continue;
    (s.use.alone ? findings.warnings : findings.errors).push_back(std::move(*error));
  }
}

void check_buried_links(const CheckedRobot& s, Findings& findings) {
  for (const std::string& posture : s.use.postures) {
    for (Error& warning : buried_links(s.robot, posture)) findings.warn(std::move(warning));
  }
}

}  // namespace tandem::robot
