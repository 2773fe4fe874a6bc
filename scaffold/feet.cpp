// Feet by the names of links at the ends of limbs, or the lowest ends; contact points, leg length
// and the direction ahead.
#include "scaffold/feet.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "model/ahead.hpp"
#include "scaffold/contact_points.hpp"
#include "scaffold/posture.hpp"
#include "scaffold/words.hpp"

namespace tandem::scaffold {
namespace {

using Eigen::Vector3d;
using model::Placement;
using model::Tree;

constexpr double kLowestShare = 0.1;   // of the height: ends so near to the lowest are feet, too
constexpr double kSoleLink_m = 0.03;   // a link called sole so near to the geometry sets the level
constexpr double kLevel = 0.98;        // cosine: a frame within 11 degrees of level
constexpr double kShank = 0.25;        // of a leg: an end so far beyond its last joint is no sole
constexpr std::size_t kFewJoints = 3;  // of a leg: hip and knee need them
constexpr std::size_t kMostWithoutAnkle = 4;  // joints of a leg
constexpr double kLargestBall = 0.2;          // of a leg's length: a larger one is no foot
constexpr double kLying = 0.3;                // cosine: an axis so near to level
constexpr double kOneWay = 0.8;  // of all legs together: they lie along an axis of the root
constexpr double kOnAxis = 0.2;  // of a wheel's radius: its centre of mass from its axis

Placement inverse(const Placement& a) { return {a.R.transpose(), -(a.R.transpose() * a.p)}; }

int foot_word(const std::string& name) {
  for (const auto& [word, rank] : {std::pair{"sole", 4}, {"foot", 3}, {"toe", 2}, {"ankle", 1}}) {
    if (mentions(name, word)) return rank;
  }
  return 0;
}

/// The best foot word among the links of a body.
int rank_of(const Tree& tree, int body) {
  int best = 0;
  for (const model::Link& link : tree.links) {
    if (link.body == body) best = std::max(best, foot_word(link.name));
  }
  return best;
}

std::vector<int> named_feet(const Tree& tree) {
  std::vector<int> bodies;
  for (int body : end_bodies(tree)) {
    int rank = rank_of(tree, body);
    const int parent = tree.joints[body - 1].parent;
    if (rank == 2 && parent > 0 && rank_of(tree, parent) >= 3) body = parent;  // a toe that moves
    if (rank > 0 && std::ranges::find(bodies, body) == bodies.end()) bodies.push_back(body);
  }
  return bodies;
}

std::vector<int> lowest_ends(const Tree& tree, const Posed& neutral) {
  double low = 0.0, high = 0.0;
  for (std::size_t b = 0; b < tree.bodies.size(); ++b) {
    const double z = neutral.body(static_cast<int>(b)).p.z();
    low = std::min(low, z);
    high = std::max(high, z);
  }
  std::vector<int> bodies = end_bodies(tree);
  std::erase_if(bodies, [&](int body) {
    return neutral.body(body).p.z() > low + kLowestShare * (high - low);
  });
  return bodies;
}

/// The length of the leg that ends in `body`, along its joints.
double leg_length(const Tree& tree, const Posed& neutral, int body) {
  double length = 0.0;
  const std::vector<int> path = tree.path_to(body);
  for (std::size_t i = 1; i < path.size(); ++i) {
    length += (neutral.origin(path[i]) - neutral.origin(path[i - 1])).norm();
  }
  return std::max(length, 0.1);
}

/// Shapes of the links called foot, sole, toe or ankle; without any, of the whole body.
ContactPatch patch_of(const Tree& tree, const Posed& neutral, int body, int& link) {
  for (const int least : {1, 0}) {
    std::vector<Shape> shapes;
    std::vector<Placement> placements;
    for (std::size_t i = 0; i < tree.links.size(); ++i) {
      const model::Link& one = tree.links[i];
      if (one.body != body || foot_word(one.name) < least) continue;
      if (shapes.empty() && !one.shapes.empty()) link = static_cast<int>(i);
      for (const Shape& shape : one.shapes) {
        shapes.push_back(shape);
        placements.push_back(neutral.link(static_cast<int>(i)));
      }
    }
    ContactPatch patch = lowest_points(shapes, placements);
    if (!patch.points.empty()) return patch;
  }
  return {};
}

int best_link(const Tree& tree, int body) {
  int best = -1;
  for (std::size_t i = 0; i < tree.links.size(); ++i) {
    const model::Link& link = tree.links[i];
    if (link.body != body) continue;
    if (best < 0 || (link.inertia.mass_kg > 0.0 && !(tree.links[best].inertia.mass_kg > 0.0))) {
      best = static_cast<int>(i);
    }
  }
  return best;
}

/// The radius of the ball that has this inertia.
double ball_radius(const model::Inertia& inertia) {
  if (!(inertia.mass_kg > 0.0)) return 0.0;
  return std::sqrt(2.5 * inertia.about_com_kg_m2.trace() / 3.0 / inertia.mass_kg);
}

/// A limb that ends far beyond its last joint ends in a point: it has no joint left that would keep
/// a sole level. Without points when it does not.
ContactPatch shank_end(const Tree& tree, const Posed& neutral, int body, int& link) {
  if (tree.path_to(body).size() > kMostWithoutAnkle) return {};
  const Vector3d knee = neutral.origin(body - 1);
  const double leg = leg_length(tree, neutral, body);
  Vector3d end = 2.0 * (neutral.body(body) * tree.bodies[body].inertia).com_m - knee;
  double farthest = 0.0, radius = 0.0;
  for (std::size_t i = 0; i < tree.links.size(); ++i) {
    const model::Link& one = tree.links[i];
    const Vector3d at = neutral.link(static_cast<int>(i)).p;
    if (one.body != body || foot_word(one.name) == 0 || (at - knee).norm() <= farthest) continue;
    link = static_cast<int>(i);
    farthest = (at - knee).norm();
    end = at;
    radius = ball_radius(one.inertia);
  }
  if ((end - knee).norm() < kShank * leg) return {};
  return {{end}, Vector3d::UnitZ(), radius < kLargestBall * leg ? radius : 0.0};
}

/// No sole stays level at the end of a shank.
void stand_on_the_middle(const Tree& tree, const Posed& neutral, FoundFoot& foot,
                         ContactPatch& patch) {
  if (patch.points.size() < 3 || tree.path_to(foot.body).size() > kFewJoints) return;
  int link = foot.link;
  if (shank_end(tree, neutral, foot.body, link).points.empty()) return;
  Vector3d middle = Vector3d::Zero();
  for (const Vector3d& p : patch.points) middle += p / static_cast<double>(patch.points.size());
  patch = {{middle}, Vector3d::UnitZ(), 0.0};
  foot.guess = "flat, on a leg that has no joint to keep it level: a point foot, its middle";
}

/// A wheel at the end of a leg: what turns without limits about a level axis that its centre of
/// mass is on. Without points when it is none.
ContactPatch wheel(const Tree& tree, const Posed& neutral, int body) {
  const Vector3d axis = neutral.axis(body - 1);
  const model::Inertia own = neutral.body(body) * tree.bodies[body].inertia;
  const bool turns = tree.joints[body - 1].type == model::JointType::kContinuous;
  if (!turns || std::abs(axis.z()) > kLying || !(own.mass_kg > 0.0)) return {};
  double radius = std::sqrt(2.0 * axis.dot(own.about_com_kg_m2 * axis) / own.mass_kg);
  const Vector3d way = own.com_m - neutral.origin(body - 1);
  if ((way - axis * axis.dot(way)).norm() > kOnAxis * radius) return {};
  for (std::size_t i = 0; i < tree.links.size(); ++i) {
    if (tree.links[i].body != body) continue;
    for (const Shape& shape : tree.links[i].shapes) {
      const bool round = shape.kind == Shape::Kind::kCylinder || shape.kind == Shape::Kind::kSphere;
      if (round && shape.size_m.x() > 0.0) radius = shape.size_m.x();
    }
  }
  return {{neutral.origin(body - 1) + axis * axis.dot(way)}, Vector3d::UnitZ(), radius};
}

/// A level link called sole says where the ground is better than a box around the foot does.
void use_sole_link(const Tree& tree, const Posed& neutral, FoundFoot& foot, ContactPatch& patch) {
  for (std::size_t i = 0; i < tree.links.size(); ++i) {
    const model::Link& link = tree.links[i];
    if (link.body != foot.body || !mentions(link.name, "sole")) continue;
    const Placement at = neutral.link(static_cast<int>(i));
    if (at.R(2, 2) < kLevel || patch.radius_m > 0.0) continue;
    if (std::abs(at.p.z() - patch.points[0].z()) > kSoleLink_m) continue;
    patch.up = at.R.col(2);
    for (Vector3d& p : patch.points) p -= patch.up * patch.up.dot(p - at.p);
    foot.link = static_cast<int>(i);
    return;
  }
}

FoundFoot make_foot(const Tree& tree, const Posed& neutral, int body) {
  FoundFoot foot;
  foot.body = body;
  foot.link = best_link(tree, body);
  ContactPatch patch = wheel(tree, neutral, body);
  if (!patch.points.empty()) {
    foot.guess = fmt::format(
        "a wheel of {:.3g} m that its drive holds still: it touches the ground in one point, and "
        "does not roll",
        patch.radius_m);
  } else {
    patch = patch_of(tree, neutral, body, foot.link);
    stand_on_the_middle(tree, neutral, foot, patch);
  }
  if (patch.points.empty()) {
    patch = shank_end(tree, neutral, body, foot.link);
    foot.guess = fmt::format("no usable collision shape: a point foot, {}; measure it",
                             patch.radius_m > 0.0
                                 ? fmt::format("a ball of {:.3f} m by its inertia", patch.radius_m)
                                 : "where the leg ends");
  }
  if (patch.points.empty()) {
    patch = equivalent_sole(neutral.body(body) * tree.bodies[body].inertia,
                            neutral.origin(body - 1), leg_length(tree, neutral, body));
    foot.guess = fmt::format(
        "no usable collision shape: a sole of the size that its inertia suggests, {:.3f} m under "
        "the last joint; measure it",
        neutral.origin(body - 1).z() - patch.points[0].z());
  }
  use_sole_link(tree, neutral, foot, patch);
  Vector3d middle = Vector3d::Zero();
  for (const Vector3d& p : patch.points) middle += p / static_cast<double>(patch.points.size());
  const Vector3d up = patch.up;
  Vector3d x = Vector3d::UnitX() - up * up.x();
  Eigen::Matrix3d R;
  R << x.normalized(), up.cross(x.normalized()), up;
  const Placement sole{R, middle};
  foot.sole_in_link = inverse(neutral.link(foot.link)) * sole;
  foot.radius_m = patch.radius_m;
  for (const Vector3d& p : patch.points) foot.points.push_back(R.transpose() * (p - middle));
  return foot;
}

}  // namespace

std::vector<FoundFoot> find_feet(const Tree& tree, const Posed& neutral, FeetBy by) {
  std::vector<FoundFoot> feet;
  for (const int body : by == FeetBy::kName ? named_feet(tree) : lowest_ends(tree, neutral)) {
    feet.push_back(make_foot(tree, neutral, body));
  }
  return feet;
}

Vector3d direction_down(const Tree& tree, const std::vector<FoundFoot>& feet,
                        const Posed& neutral) {
  Vector3d way = Vector3d::Zero();
  double length = 0.0;
  for (const FoundFoot& foot : feet) {
    const Vector3d leg = (neutral.body(foot.body) * tree.bodies[foot.body].inertia).com_m -
                         neutral.origin(tree.path_to(foot.body).front());
    way += leg;
    length += leg.norm();
  }
  Eigen::Index axis = 2;
  const double most = way.cwiseAbs().maxCoeff(&axis);
  if (most < kOneWay * length) return -Vector3d::UnitZ();
  return Vector3d::Unit(axis) * (way[axis] > 0.0 ? 1.0 : -1.0);
}

Vector3d direction_ahead_of(const Tree& tree, const std::vector<FoundFoot>& feet,
                            const Posed& neutral, const Vector3d& down) {
  Vector3d turning = Vector3d::Zero(), reach = Vector3d::Zero();
  for (const FoundFoot& foot : feet) {
    for (const int j : tree.path_to(foot.body))
      if (!neutral.slides(j)) turning += neutral.axis(j).cwiseAbs();
    reach += (neutral.body(foot.body) * tree.bodies[foot.body].inertia).com_m -
             neutral.origin(foot.body - 1);
  }
  turning -= turning.cwiseProduct(down.cwiseAbs());
  Eigen::Index across = 0;
  turning.maxCoeff(&across);
  const Vector3d along = down.cross(Vector3d::Unit(across)).cwiseAbs();
  constexpr double kLeast_m = 0.005;  // of a reach
  return reach.dot(along) < -kLeast_m * static_cast<double>(feet.size()) ? Vector3d(-along) : along;
}

Vector3d direction_ahead(const std::vector<FoundFoot>& feet, const Posed& neutral) {
  std::vector<model::FootReach> reach;
  for (const FoundFoot& foot : feet) {
    if (!foot.flat()) continue;
    reach.push_back(
        {neutral.origin(foot.body - 1), (neutral.link(foot.link) * foot.sole_in_link).p});
  }
  return model::direction_ahead(reach);
}

void face_ahead(const Vector3d& ahead, const Posed& neutral, std::vector<FoundFoot>& feet) {
  for (FoundFoot& foot : feet) {
    const Placement sole = neutral.link(foot.link) * foot.sole_in_link;
    const Vector3d up = sole.R.col(2);
    const Vector3d x = (ahead - up * up.dot(ahead)).normalized();
    Eigen::Matrix3d R;
    R << x, up.cross(x), up;
    for (Vector3d& p : foot.points) p = R.transpose() * (sole.R * p);
    foot.sole_in_link = inverse(neutral.link(foot.link)) * Placement{R, sole.p};
  }
}

void settle_balls(const Vector3d& ahead, const Posed& standing, std::vector<FoundFoot>& feet) {
  for (FoundFoot& foot : feet) {
    if (foot.flat()) continue;
    const Placement link = standing.link(foot.link);
    Eigen::Matrix3d R;
    R << ahead, Vector3d::UnitZ().cross(ahead), Vector3d::UnitZ();
    const Placement old = link * foot.sole_in_link;
    for (Vector3d& p : foot.points) p = R.transpose() * (old.R * p);
    const Vector3d bottom = old.p - Vector3d(0.0, 0.0, foot.radius_m);
    foot.sole_in_link = inverse(link) * Placement{R, bottom};
    foot.radius_m = 0.0;
  }
}

}  // namespace tandem::scaffold
