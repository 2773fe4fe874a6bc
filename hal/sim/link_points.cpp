// Corners and rims of collision shapes, else the corners of the homogeneous box with the link's
// mass and inertia.
#include "hal/sim/link_points.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace tandem::sim {
namespace {

using Eigen::Vector3d;
using model::Shape;

constexpr double kLeastDensity_kg_m3 = 200.0;
constexpr double kAnkleShare = 0.2;  // of the leg's length

void add_corners(const Vector3d& edge, const model::Placement& at, std::vector<Vector3d>& to) {
  for (const double x : {-0.5, 0.5})
    for (const double y : {-0.5, 0.5})
      for (const double z : {-0.5, 0.5})
        to.push_back(at.R * Vector3d(x * edge.x(), y * edge.y(), z * edge.z()) + at.p);
}

void add_rim(double radius, double z, int count, const model::Placement& at,
             std::vector<Vector3d>& to) {
  for (int i = 0; i < count; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / count;
    to.push_back(at.R * Vector3d(radius * std::cos(angle), radius * std::sin(angle), z) + at.p);
  }
}

void add_shape(const Shape& shape, const model::Placement& at, std::vector<Vector3d>& to) {
  const double radius = shape.size_m.x(), half = 0.5 * shape.size_m.z();
  switch (shape.kind) {
    case Shape::Kind::kBox: return add_corners(shape.size_m, at, to);
    case Shape::Kind::kCylinder:
      add_rim(radius, -half, 4, at, to);
      return add_rim(radius, half, 4, at, to);
    case Shape::Kind::kCapsule:
      add_rim(radius, -half, 3, at, to);
      add_rim(radius, half, 3, at, to);
      for (const double z : {-half - radius, half + radius}) to.push_back(at.R.col(2) * z + at.p);
      return;
    case Shape::Kind::kSphere:
      for (int axis = 0; axis < 3; ++axis)
        for (const double side : {-radius, radius}) to.push_back(at.R.col(axis) * side + at.p);
      return;
    case Shape::Kind::kMesh: return;
  }
}

void add_equivalent_box(const model::Inertia& inertia, const model::Placement& at,
                        std::vector<Vector3d>& to) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> principal(inertia.about_com_kg_m2);
  const Vector3d& moments = principal.eigenvalues();
  Vector3d edge;
  for (int i = 0; i < 3; ++i) {
    const double square = 6.0 * (moments.sum() - 2.0 * moments[i]) / inertia.mass_kg;
    edge[i] = std::sqrt(std::max(0.0, square));
  }
  const double density = inertia.mass_kg / edge.prod();  // infinite of a plate
  if (density < kLeastDensity_kg_m3) edge *= std::cbrt(density / kLeastDensity_kg_m3);
  const model::Placement box{principal.eigenvectors(), inertia.com_m};
  add_corners(edge, at * box, to);
}

/// Soles' links, and the ankles above them.
std::vector<bool> feet_of(const hal::RobotConfig& robot, const model::Tree& tree) {
  std::vector<bool> feet(tree.links.size(), false);
  const auto offset = [&](const model::Link& link) {  // from the parent's frame to this one
    const model::Link& above = tree.links[static_cast<std::size_t>(link.parent)];
    if (link.moving >= 0) {
      const model::Joint& joint = tree.joints[static_cast<std::size_t>(link.moving)];
      return (joint.in_parent.p - above.in_body.p).norm();
    }
    return (link.in_body.p - above.in_body.p).norm();
  };
  for (const hal::Foot& foot : robot.contact.feet) {
    const auto site = std::ranges::find(robot.model.sites, foot.site, &hal::SiteConfig::name);
    if (site == robot.model.sites.end()) continue;
    const int sole = tree.link_index(site->link);
    double leg_m = 0.0;
    for (int i = sole; i > 0; i = tree.links[static_cast<std::size_t>(i)].parent)
      leg_m += offset(tree.links[static_cast<std::size_t>(i)]);
    for (int i = sole; i >= 0; i = tree.links[static_cast<std::size_t>(i)].parent) {
      feet[static_cast<std::size_t>(i)] = true;
      if (i == 0 || offset(tree.links[static_cast<std::size_t>(i)]) > kAnkleShare * leg_m) break;
    }
  }
  return feet;
}

}  // namespace

std::vector<LinkPoints> link_points(const hal::RobotConfig& robot, const model::Tree& tree) {
  const std::vector<bool> feet = feet_of(robot, tree);
  std::vector<LinkPoints> all;
  for (std::size_t i = 0; i < tree.links.size(); ++i) {
    const model::Link& link = tree.links[i];
    if (feet[i] || (link.body == 0 && !tree.floating_base)) continue;
    LinkPoints points{.link = i};
    for (const Shape& shape : link.shapes) {
      add_shape(shape, link.in_body * shape.in_link, points.in_body_m);
    }
    points.guessed = points.in_body_m.empty() && link.inertia.mass_kg > 0.0;
    if (points.guessed) add_equivalent_box(link.inertia, link.in_body, points.in_body_m);
    if (!points.in_body_m.empty()) all.push_back(std::move(points));
  }
  return all;
}

}  // namespace tandem::sim
