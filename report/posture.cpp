// Forward kinematics of the description's tree at four moments, projected; limbs as lines between
// joints.
#include "report/posture.hpp"

#include <fmt/core.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

#include "model/ahead.hpp"
#include "model/placements.hpp"
#include "report/layout.hpp"

namespace tandem::report {
namespace {

constexpr double kGap = std::numeric_limits<double>::quiet_NaN();

/// For two decimals, without a sign before 0.
double hundredths(double value) { return std::round(value * 100.0) / 100.0 + 0.0; }

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
  for (const hal::Foot& foot : robot.contact.feet) {
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

void add_point(Curve& curve, const Eigen::Vector3d& point) {
  curve.x.push_back(point.x());
  curve.y.push_back(point.z());
}

/// Where a site of robot.toml is.
struct SitePlace {
  std::size_t body = 0;  ///< that carries it
  model::Placement in_W;
};

std::optional<SitePlace> place_of(const std::string& name, const model::Tree& tree,
                                  const hal::RobotConfig& robot,
                                  std::span<const model::Placement> bodies) {
  const auto site = std::ranges::find(robot.model.sites, name, &hal::SiteConfig::name);
  const int index = site == robot.model.sites.end() ? -1 : tree.link_index(site->link);
  if (index < 0) return std::nullopt;
  const model::Link& link = tree.links[static_cast<std::size_t>(index)];
  const auto body = static_cast<std::size_t>(link.body);
  return SitePlace{body,
                   bodies[body] * link.in_body * model::placement_of(site->xyz_m, site->rpy_rad)};
}

/// A foot's contact points in W, and the last body before them.
struct FootPoints {
  std::size_t body = 0;
  std::vector<Eigen::Vector3d> points_m;
};

std::vector<FootPoints> feet_of(const model::Tree& tree, const hal::RobotConfig& robot,
                                std::span<const model::Placement> bodies) {
  std::vector<FootPoints> feet;
  for (const hal::Foot& foot : robot.contact.feet) {
    const std::optional<SitePlace> sole = place_of(foot.site, tree, robot, bodies);
    if (!sole) continue;
    FootPoints& one = feet.emplace_back();
    one.body = sole->body;
    for (const auto& point : foot.points_m) {
      one.points_m.push_back(sole->in_W.R * Eigen::Map<const Eigen::Vector3d>(point.data()) +
                             sole->in_W.p);
    }
    if (one.points_m.empty()) one.points_m.push_back(sole->in_W.p);
  }
  return feet;
}

/// What closes a loop: from the last joint on one side over both sites to the other side's. The
/// sites coincide, or a rod is between them.
struct ClosureLine {
  std::array<std::size_t, 2> bodies{};
  bool leg = false;
  std::vector<Eigen::Vector3d> points_m;
};

std::vector<ClosureLine> loops_of(const model::Tree& tree, const hal::RobotConfig& robot,
                                  std::span<const model::Placement> bodies) {
  const std::vector<bool> leg = leg_bodies(tree, robot);
  std::vector<ClosureLine> lines;
  for (const model::KinematicLoop& loop : robot.loops) {
    const auto a = place_of(loop.sites[0], tree, robot, bodies);
    const auto b = place_of(loop.sites[1], tree, robot, bodies);
    if (!a || !b) continue;
    lines.push_back({{a->body, b->body},
                     leg[a->body] || leg[b->body],
                     {bodies[a->body].p, a->in_W.p, b->in_W.p, bodies[b->body].p}});
  }
  return lines;
}

/// Every body's origin, the feet's points and the loops'.
std::vector<Eigen::Vector3d> drawn_points(const model::Tree& tree, const hal::RobotConfig& robot,
                                          std::span<const model::Placement> bodies) {
  std::vector<Eigen::Vector3d> points;
  for (const model::Placement& body : bodies) points.push_back(body.p);
  for (const FootPoints& foot : feet_of(tree, robot, bodies)) {
    points.insert(points.end(), foot.points_m.begin(), foot.points_m.end());
  }
  for (const ClosureLine& loop : loops_of(tree, robot, bodies)) {
    points.insert(points.end(), loop.points_m.begin(), loop.points_m.end());
  }
  return points;
}

/// The feet as lines from the last joint to the hindmost and on to the foremost contact point.
void add_feet(Curve& curve, std::span<const FootPoints> feet,
              std::span<const model::Placement> bodies) {
  for (const FootPoints& foot : feet) {
    const auto [heel, toe] = std::ranges::minmax_element(
        foot.points_m, {}, [](const Eigen::Vector3d& p) { return p.x(); });
    add_point(curve, bodies[foot.body].p);
    add_point(curve, *heel);
    add_point(curve, *toe);
    curve.x.push_back(kGap);
    curve.y.push_back(kGap);
  }
}

/// The lines of all figures.
struct Sticks {
  explicit Sticks(std::string trunk_name) { trunk.label = std::move(trunk_name); }
  Curve others{"arms and head", CurveStyle::kStickThird, {}, {}};
  Curve trunk{{}, CurveStyle::kStickSecond, {}, {}};
  Curve legs{"legs", CurveStyle::kStick, {}, {}};
};

/// What one figure takes, across and up.
struct Extents {
  Extent across_m, up_m;
};

Extents extents_of(const Sticks& sticks) {
  Extents out;
  for (const Curve* curve : {&sticks.others, &sticks.trunk, &sticks.legs}) {
    for (const double x : curve->x) out.across_m.include(x);
    for (const double z : curve->y) out.up_m.include(z);
  }
  return out;
}

/// Where figures and their texts stand beside each other.
struct Row {
  std::vector<double> middle_m;  ///< of each figure
  double end_m = 0.0;            ///< of the last one; the first begins at 0
  double line_m = 0.0;           ///< between lines of text below
};

/// Each gets what it takes and a margin, but not so little that thin ones crowd, or that the texts
/// below it, a seventh of the whole across, touch the next ones.
Row row_of(std::span<const Extents> figures, double height_m) {
  constexpr double kAspect = 1.9;  // of the drawing: width over height
  constexpr double kMargin = 1.2, kThin = 0.6;
  const double text = std::min(0.14, 0.9 / static_cast<double>(figures.size()));
  Row row;
  for (int i = 0; i < 50; ++i) {  // until the texts' share of the whole has settled
    const double least_m = std::max(kThin * height_m, text * row.end_m);
    row.middle_m.clear();
    row.end_m = 0.0;
    for (const Extents& one : figures) {
      const double wide_m = std::max(least_m, kMargin * (one.across_m.high - one.across_m.low));
      row.middle_m.push_back(row.end_m + 0.5 * wide_m);
      row.end_m += wide_m;
    }
  }
  row.line_m = 0.095 * std::max(height_m, row.end_m / kAspect);
  return row;
}

void append(const Curve& from, double shift_m, Curve& to) {
  for (const double x : from.x) to.x.push_back(x + shift_m);
  to.y.insert(to.y.end(), from.y.begin(), from.y.end());
}

void end_line(Curve& curve) {
  curve.x.push_back(kGap);
  curve.y.push_back(kGap);
}

/// One figure. A limb ends at its last body's foot, its loops or else its centre of mass.
void add_figure(Sticks& sticks, std::span<const Limb> limbs, const model::Tree& tree,
                const hal::RobotConfig& robot, std::span<const model::Placement> bodies) {
  const std::vector<ClosureLine> loops = loops_of(tree, robot, bodies);
  const bool legged = !robot.contact.feet.empty();
  for (const Limb& limb : limbs) {
    Curve& curve = limb.leg ? sticks.legs : (limb.trunk || !legged ? sticks.trunk : sticks.others);
    if (limb.leg) {  // as far as the hip it is trunk
      for (int i = 0; i < 2; ++i) {
        add_point(sticks.trunk, bodies[static_cast<std::size_t>(limb.bodies[i])].p);
      }
      end_line(sticks.trunk);
    }
    for (const int body : std::span(limb.bodies).subspan(limb.leg ? 1 : 0)) {
      add_point(curve, bodies[static_cast<std::size_t>(body)].p);
    }
    const auto tip = static_cast<std::size_t>(limb.bodies.back());
    const bool goes_on = std::ranges::any_of(loops, [tip](const ClosureLine& loop) {
      return loop.bodies[0] == tip || loop.bodies[1] == tip;
    });
    if (!limb.leg && !goes_on) {
      add_point(curve, bodies[tip].R * tree.bodies[tip].inertia.com_m + bodies[tip].p);
    }
    end_line(curve);
  }
  for (const ClosureLine& loop : loops) {
    Curve& curve = loop.leg ? sticks.legs : sticks.trunk;
    for (const Eigen::Vector3d& point : loop.points_m) add_point(curve, point);
    end_line(curve);
  }
  add_feet(sticks.legs, feet_of(tree, robot, bodies), bodies);
}

/// Whether there is more to see from the front than from the side: by how far each figure reaches
/// across, and how far the bodies' centres of mass move.
bool shows_more_from_front(const model::Tree& tree, const hal::RobotConfig& robot,
                           std::span<const PostureSample> samples) {
  Eigen::Vector2d reach = Eigen::Vector2d::Zero();
  const auto first = body_placements(tree, robot, samples.front());
  Eigen::Vector3d way = Eigen::Vector3d::Zero();
  for (const PostureSample& sample : samples) {
    const auto bodies = body_placements(tree, robot, sample);
    Eigen::AlignedBox3d box;
    for (const Eigen::Vector3d& point : drawn_points(tree, robot, bodies)) box.extend(point);
    reach += box.sizes().head<2>();
    for (std::size_t i = 0; i < bodies.size(); ++i) {
      const Eigen::Vector3d com = tree.bodies[i].inertia.com_m;
      const Eigen::Vector3d moved = bodies[i].R * com + bodies[i].p - first[i].R * com - first[i].p;
      way = way.cwiseMax(moved.cwiseAbs());
    }
  }
  return reach.y() + way.y() > reach.x() + way.x();
}

double position_of(const hal::RobotConfig& robot, const std::string& joint,
                   const PostureSample& sample) {
  std::size_t index = robot.joints.size();
  if (const int driven = robot.joint_index(joint); driven >= 0) {
    index = static_cast<std::size_t>(driven);
  } else {
    index += static_cast<std::size_t>(
        std::ranges::find(robot.passive, joint, &hal::PassiveConfig::name) - robot.passive.begin());
  }
  return index < sample.position_rad.size() ? sample.position_rad[index] : 0.0;
}

/// Where the robot looks, in its root's frame: by the feet's points of contact.
Eigen::Vector3d ahead_of(const model::Tree& tree, const hal::RobotConfig& robot,
                         PostureSample sample) {
  sample.base = {};
  const auto bodies = body_placements(tree, robot, sample);
  std::vector<model::FootReach> reach;
  for (const FootPoints& foot : feet_of(tree, robot, bodies)) {
    if (foot.points_m.size() <= 2 || foot.body == 0) continue;
    Eigen::Vector3d middle = Eigen::Vector3d::Zero();
    for (const Eigen::Vector3d& point : foot.points_m) middle += point;
    reach.push_back({bodies[foot.body].p, middle / static_cast<double>(foot.points_m.size())});
  }
  return model::direction_ahead(reach);
}

/// What passive joints move and nobody knows where it is.
std::vector<bool> unknown_bodies(const model::Tree& tree, const hal::RobotConfig& robot,
                                 std::span<const PostureSample> samples) {
  std::vector<bool> unknown(tree.bodies.size(), false);
  const std::size_t all = robot.joints.size() + robot.passive.size();
  const bool known = std::ranges::all_of(
      samples, [all](const PostureSample& sample) { return sample.position_rad.size() >= all; });
  for (std::size_t j = 0; !known && j < tree.joints.size(); ++j) {
    const bool passive = std::ranges::find(robot.passive, tree.joints[j].name,
                                           &hal::PassiveConfig::name) != robot.passive.end();
    unknown[j + 1] = passive || unknown[static_cast<std::size_t>(tree.joints[j].parent)];
  }
  return unknown;
}

/// The limbs without bodies whose place nobody knows.
std::vector<Limb> known_limbs(const model::Tree& tree, const hal::RobotConfig& robot,
                              const std::vector<bool>& unknown) {
  std::vector<Limb> limbs = limbs_of(tree, robot);
  for (Limb& limb : limbs) {
    std::erase_if(limb.bodies, [&](int body) { return unknown[static_cast<std::size_t>(body)]; });
  }
  std::erase_if(limbs, [](const Limb& limb) { return limb.bodies.size() < 2; });
  return limbs;
}

/// What goes to the drawing's right, as the angle of W's x to it: ahead or, from the front, W's y.
double view_of(const model::Tree& tree, const hal::RobotConfig& robot,
               std::span<const PostureSample> moments, bool from_front) {
  const Eigen::Vector3d right = from_front ? Eigen::Vector3d(Eigen::Vector3d::UnitY())
                                           : ahead_of(tree, robot, moments.front());
  return std::atan2(right.y(), right.x());
}

/// The moments, turned so that W's x is what goes to the drawing's right.
std::vector<PostureSample> turned(const model::Tree& tree, const hal::RobotConfig& robot,
                                  std::span<const PostureSample> moments, double view_rad) {
  const Eigen::AngleAxisd view(-view_rad, Eigen::Vector3d::UnitZ());
  const model::Placement turn{view.toRotationMatrix(), Eigen::Vector3d::Zero()};
  std::vector<PostureSample> samples(moments.begin(), moments.end());
  for (PostureSample& sample : samples) {
    sample.base = turn * sample.base;
    if (sample.placed) continue;
    const std::optional<double> lowest_m = lowest_foot_m(tree, robot, sample);
    if (lowest_m) sample.base.p.z() += robot.contact.height_m - *lowest_m;
  }
  return samples;
}

/// The ground that is not level, along the line to the drawing's right through a moment's base;
/// empty: it is level, or nobody knows where the base is.
/// @param along_m  from the base
Curve ground_under(const PostureSample& moment, double view_rad, const Extent& along_m) {
  constexpr int kPieces = 200;
  Curve curve{"ground", CurveStyle::kThird, {}, {}};
  if (moment.ground == nullptr || moment.ground->terrain.level() || !moment.placed) return curve;
  for (int i = 0; i <= kPieces; ++i) {
    const double d_m = along_m.low + (along_m.high - along_m.low) * i / kPieces;
    const double x_m = moment.base.p.x() + d_m * std::cos(view_rad) - moment.ground_m[0];
    const double y_m = moment.base.p.y() + d_m * std::sin(view_rad) - moment.ground_m[1];
    curve.x.push_back(d_m);
    curve.y.push_back(moment.ground->height_m + moment.ground_m[2] +
                      moment.ground->terrain.at(x_m, y_m).height_m);
  }
  end_line(curve);
  return curve;
}

Figure empty_figure(bool from_front, bool leaves_out, bool unplaced, bool legged) {
  Figure figure;
  figure.name = "posture";
  figure.title =
      from_front ? "Posture, seen from the front" : "Posture, seen from the robot's right";
  if (leaves_out) figure.title += ", without what passive joints move";
  if (unplaced) figure.title += legged ? "; base unknown: upright on its feet" : "; base unknown";
  figure.y_label = "z [m]";
  figure.equal_axes = true;
  return figure;
}

}  // namespace

std::vector<model::Placement> body_placements(const model::Tree& tree,
                                              const hal::RobotConfig& robot,
                                              const PostureSample& sample) {
  std::vector<double> position;
  for (const model::Joint& joint : tree.joints)
    position.push_back(position_of(robot, joint.name, sample));
  return model::place_bodies(tree, position, sample.base);
}

std::optional<double> lowest_foot_m(const model::Tree& tree, const hal::RobotConfig& robot,
                                    const PostureSample& sample) {
  std::optional<double> lowest_m;
  for (const FootPoints& foot : feet_of(tree, robot, body_placements(tree, robot, sample))) {
    for (const Eigen::Vector3d& point : foot.points_m)
      lowest_m = std::min(lowest_m.value_or(point.z()), point.z());
  }
  return lowest_m;
}

Figure posture_figure(const model::Tree& tree, const hal::RobotConfig& configured,
                      std::span<const PostureSample> moments) {
  const std::vector<bool> unknown = unknown_bodies(tree, configured, moments);
  const bool leaves_out = std::ranges::find(unknown, true) != unknown.end();
  hal::RobotConfig robot = configured;
  if (leaves_out) robot.loops.clear();
  const bool legged = !robot.contact.feet.empty();
  const bool from_front = !legged && shows_more_from_front(tree, robot, moments);
  const double view_rad = view_of(tree, robot, moments, from_front);
  const std::vector<PostureSample> samples = turned(tree, robot, moments, view_rad);
  const bool unplaced = !std::ranges::all_of(samples, &PostureSample::placed);
  Figure figure = empty_figure(from_front, leaves_out, unplaced, legged);
  Sticks sticks(legged ? "trunk" : robot.name);
  const std::vector<Limb> limbs = known_limbs(tree, robot, unknown);
  std::vector<Sticks> drawn;
  std::vector<Extents> extents;
  std::vector<Curve> grounds;
  Extent up_m;
  if (legged) up_m.include(robot.contact.height_m);
  for (const PostureSample& sample : samples) {
    add_figure(drawn.emplace_back(""), limbs, tree, robot, body_placements(tree, robot, sample));
    extents.push_back(extents_of(drawn.back()));
    up_m.include(extents.back().up_m.low);
    up_m.include(extents.back().up_m.high);
    const Extent& across_m = extents.back().across_m;
    const double beside_m = 0.1 * (across_m.high - across_m.low);
    const double base_m = sample.base.p.x();
    grounds.push_back(
        ground_under(moments[grounds.size()], view_rad,
                     {across_m.low - beside_m - base_m, across_m.high + beside_m - base_m}));
    for (double& x : grounds.back().x) x += base_m;
    for (const double z : grounds.back().y) up_m.include(z);
  }
  const Row row = row_of(extents, up_m.high - up_m.low);
  const auto moved = [&](std::size_t s) {
    return row.middle_m[s] - 0.5 * (extents[s].across_m.low + extents[s].across_m.high);
  };
  const double begin_m = -moved(0) - samples[0].base.p.x();     // the first one's base is at 0
  for (const double edge_m : {begin_m, begin_m + row.end_m}) {  // the outer texts are inside, too
    sticks.trunk.x.push_back(edge_m);
    sticks.trunk.y.push_back(kGap);
  }
  Curve ground{"ground", CurveStyle::kThird, {}, {}};
  for (std::size_t s = 0; s < samples.size(); ++s) {
    const double shift_m = moved(s) + begin_m;
    append(grounds[s], shift_m, ground);
    append(drawn[s].others, shift_m, sticks.others);
    append(drawn[s].trunk, shift_m, sticks.trunk);
    append(drawn[s].legs, shift_m, sticks.legs);
    const double x = begin_m + row.middle_m[s];
    figure.notes.push_back({samples[s].label, x, up_m.low - row.line_m});
    figure.notes.push_back(
        {fmt::format("{:.2f} s", hundredths(samples[s].time_s)), x, up_m.low - 2.0 * row.line_m});
  }
  if (legged && robot.contact.terrain.level())
    figure.levels.push_back({"ground", robot.contact.height_m});
  for (Curve* curve : {&ground, &sticks.others, &sticks.trunk, &sticks.legs}) {
    if (!curve->x.empty()) figure.curves.push_back(std::move(*curve));
  }
  return figure;
}

}  // namespace tandem::report
