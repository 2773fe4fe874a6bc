// Sites and [contact] in proportion to COMAN's, by the weight on each point.
#include "scaffold/steps.hpp"

#include <cmath>

#include "model/placements.hpp"
#include "scaffold/posed.hpp"

namespace tandem::scaffold {
namespace {

// COMAN's contact over its weight on each of eight points: docs/robots.md.
constexpr double kStiffness_1_m = 648.0;
constexpr double kDamping_s_m = 3.3;
constexpr double kTangentialDamping_s_m = 2.33;

double clean(double value, double step) {
  const double result = std::round(value / step) * step;
  return result == 0.0 ? 0.0 : result;
}

hal::SiteConfig site_of(const model::Tree& tree, const FoundFoot& foot) {
  hal::SiteConfig site;
  site.name = foot.name;
  site.link = tree.links[foot.link].name;
  site.wrench = true;
  const std::array<double, 3> rpy = model::rpy_of(foot.sole_in_link.R);
  for (int i = 0; i < 3; ++i) site.rpy_rad[i] = clean(rpy[i], 1e-8);
  for (int i = 0; i < 3; ++i) site.xyz_m[i] = clean(foot.sole_in_link.p[i], 1e-6);
  return site;
}

}  // namespace

void fill_ground(const hal::RobotConfig* like, NewRobot& robot) {
  hal::ContactConfig& contact = robot.config.contact;
  double points = 0.0;
  for (const FoundFoot& foot : robot.feet) {
    robot.config.model.sites.push_back(site_of(robot.tree, foot));
    hal::Foot config;
    config.site = foot.name;
    for (const Eigen::Vector3d& p : foot.points) {
      config.points_m.push_back({clean(p.x(), 1e-5), clean(p.y(), 1e-5), clean(p.z(), 1e-5)});
      points += 1.0;
    }
    contact.feet.push_back(std::move(config));
  }
  const double weight_N = robot.mass_kg * kGravity_m_s2 / points;
  contact.stiffness_N_m = rounded(kStiffness_1_m * weight_N);
  contact.damping_s_m = kDamping_s_m;
  contact.tangential_stiffness_N_m = contact.stiffness_N_m;
  contact.tangential_damping_Ns_m = rounded(kTangentialDamping_s_m * weight_N);
  contact.static_friction = 0.9;
  contact.sliding_friction = 0.8;
  if (like == nullptr || like->contact.feet.empty()) return;
  contact.damping_s_m = like->contact.damping_s_m;
  contact.static_friction = like->contact.static_friction;
  contact.sliding_friction = like->contact.sliding_friction;
}

}  // namespace tandem::scaffold
