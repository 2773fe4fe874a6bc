#include "report/posture.hpp"

#include <fmt/core.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <limits>

namespace tandem::report {
namespace {

constexpr double kGap = std::numeric_limits<double>::quiet_NaN();

/// Limbs end where the tree branches. A limb is the bodies from a branch (or the root) on.
struct Limb {
  std::vector<int> bodies;  ///< the first is where it starts from
  bool leg = false;
  bool trunk = false;
};

std::vector<std::vector<int>> children_of(const model::Tree& tree) {
  std::vector<std::vector<int>> children(tree.bodies.size());
  for (std::size_t i = 0; i < tree.joints.size(); ++i) {
    children[static_cast<std::size_t>(tree.joints[i].parent)].push_back(static_cast<int>(i) + 1);
  }
  return children;
}

/// Whether a body or one that it carries has a foot's site.
std::vector<bool> leg_bodies(const model::Tree& tree, const hal::RobotConfig& robot) {
  std::vector<bool> leg(tree.bodies.size(), false);
  for (const hal::FootConfig& foot : robot.contact.feet) {
    for (const hal::SiteConfig& site : robot.model.sites) {
      const int link = site.name == foot.site ? tree.link_index(site.link) : -1;
      if (link < 0) continue;
      for (int body = tree.links[static_cast<std::size_t>(link)].body; body > 0;
           body = tree.joints[static_cast<std::size_t>(body) - 1].parent) {
        leg[static_cast<std::size_t>(body)] = true;
      }
    }
  }
  return leg;
}

std::vector<Limb> limbs_of(const model::Tree& tree, const hal::RobotConfig& robot) {
  const auto children = children_of(tree);
  const std::vector<bool> leg = leg_bodies(tree, robot);
  std::vector<Limb> limbs;
  for (std::size_t from = 0; from < children.size(); ++from) {
    if (from != 0 && children[from].size() < 2) continue;
    for (const int first : children[from]) {
      Limb limb{{static_cast<int>(from), first}, leg[static_cast<std::size_t>(first)], from == 0};
      for (int body = first; children[static_cast<std::size_t>(body)].size() == 1;) {
        body = children[static_cast<std::size_t>(body)].front();
        limb.bodies.push_back(body);
      }
      limbs.push_back(limb);
    }
  }
  return limbs;
}

void add_point(Curve& curve, const Eigen::Vector3d& point, double shift_m) {
  curve.x.push_back(point.x() + shift_m);
  curve.y.push_back(point.z());
}

struct Spread {
  double low_m = 0.0, high_m = 0.0;  ///< heights of the first figure
  double pitch_m = 0.0;              ///< from one figure to the next, so that none touch
};

Spread spread(const model::Tree& tree, const hal::RobotConfig& robot,
              std::span<const PostureSample> samples) {
  Spread out;
  if (!robot.contact.feet.empty()) out.low_m = out.high_m = robot.contact.height_m;
  double widest = 0.0;
  for (const PostureSample& sample : samples) {
    double left = 1e300;
    double right = -1e300;
    for (const model::Placement& body : body_placements(tree, robot, sample)) {
      left = std::min(left, body.p.x());
      right = std::max(right, body.p.x());
      if (&sample != &samples.front()) continue;
      out.low_m = std::min(out.low_m, body.p.z());
      out.high_m = std::max(out.high_m, body.p.z());
    }
    widest = std::max(widest, right - left);
  }
  out.pitch_m = std::max(0.6 * (out.high_m - out.low_m), 1.2 * widest);
  return out;
}

/// The soles as lines from heel to toe.
void add_soles(Curve& curve, const model::Tree& tree, const hal::RobotConfig& robot,
               std::span<const model::Placement> bodies, double shift_m) {
  for (const hal::FootConfig& foot : robot.contact.feet) {
    for (const hal::SiteConfig& site : robot.model.sites) {
      const int index = site.name == foot.site ? tree.link_index(site.link) : -1;
      if (index < 0) continue;
      const model::Link& link = tree.links[static_cast<std::size_t>(index)];
      const auto rotation = [&](int axis) {
        return Eigen::AngleAxisd(site.rpy_rad[static_cast<std::size_t>(axis)],
                                 Eigen::Vector3d::Unit(axis));
      };
      const model::Placement in_link{(rotation(2) * rotation(1) * rotation(0)).matrix(),
                                     Eigen::Map<const Eigen::Vector3d>(site.xyz_m.data())};
      const model::Placement sole =
          bodies[static_cast<std::size_t>(link.body)] * link.in_body * in_link;
      const auto [heel, toe] = std::ranges::minmax_element(
          foot.points_m, {}, [](const std::array<double, 3>& p) { return p[0]; });
      for (const auto& point : {*heel, *toe}) {
        const Eigen::Vector3d in_site(point[0], 0.0, point[2]);
        add_point(curve, sole.R * in_site + sole.p, shift_m);
      }
      curve.x.push_back(kGap);
      curve.y.push_back(kGap);
    }
  }
}

}  // namespace

std::vector<model::Placement> body_placements(const model::Tree& tree,
                                              const hal::RobotConfig& robot,
                                              const PostureSample& sample) {
  std::vector<model::Placement> bodies{sample.base};
  for (const model::Joint& joint : tree.joints) {
    const int index = robot.joint_index(joint.name);
    const double q = index < 0 ? 0.0 : sample.position_rad[static_cast<std::size_t>(index)];
    model::Placement motion;
    if (joint.type == model::JointType::kPrismatic) {
      motion.p = q * joint.axis;
    } else {
      motion.R = Eigen::AngleAxisd(q, joint.axis).matrix();
    }
    bodies.push_back(bodies[static_cast<std::size_t>(joint.parent)] * joint.in_parent * motion);
  }
  return bodies;
}

Figure posture_figure(const model::Tree& tree, const hal::RobotConfig& robot,
                      std::span<const PostureSample> samples) {
  Figure figure;
  figure.name = "posture";
  figure.title = "Posture, seen from the robot's right";
  figure.y_label = "z [m]";
  figure.equal_axes = true;
  Curve others{"arms and head", CurveStyle::kStickThird, {}, {}};
  const bool legged = !robot.contact.feet.empty();
  Curve trunk{legged ? "trunk" : robot.name, CurveStyle::kStickSecond, {}, {}};
  Curve legs{"legs", CurveStyle::kStick, {}, {}};
  const std::vector<Limb> limbs = limbs_of(tree, robot);

  const auto [low, high, pitch_m] = spread(tree, robot, samples);
  for (std::size_t s = 0; s < samples.size(); ++s) {
    const double shift_m = static_cast<double>(s) * pitch_m - samples[s].base.p.x();
    const auto bodies = body_placements(tree, robot, samples[s]);
    for (const Limb& limb : limbs) {
      Curve& curve = limb.leg ? legs : (limb.trunk ? trunk : others);
      for (const int body : limb.bodies) {
        add_point(curve, bodies[static_cast<std::size_t>(body)].p, shift_m);
      }
      const auto tip = static_cast<std::size_t>(limb.bodies.back());
      if (!limb.leg) {
        add_point(curve, bodies[tip].R * tree.bodies[tip].inertia.com_m + bodies[tip].p, shift_m);
      }
      curve.x.push_back(kGap);
      curve.y.push_back(kGap);
    }
    add_soles(legs, tree, robot, bodies, shift_m);
    const double x = shift_m + samples[s].base.p.x();
    figure.notes.push_back({samples[s].label, x, low - 0.08 * (high - low)});
    figure.notes.push_back(
        {fmt::format("{:.2f} s", samples[s].time_s), x, low - 0.17 * (high - low)});
  }
  if (legged) figure.levels.push_back({"ground", robot.contact.height_m, false});
  for (Curve* curve : {&others, &trunk, &legs}) {
    if (!curve->x.empty()) figure.curves.push_back(std::move(*curve));
  }
  return figure;
}

}  // namespace tandem::report
