// The face, rim or point of each shape that faces down, and of several shapes those within 10 mm of
// the lowest; else the sole of the equivalent box.
#include "scaffold/contact_points.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace tandem::scaffold {
namespace {

using Eigen::Vector3d;

constexpr double kSameLevel_m = 0.01;  // points so much above the lowest still belong to the sole
constexpr double kFlat_m = 5e-4;       // points so near to a plane are in it
constexpr double kNearlyLevel = 0.97;  // cosine: a plane within 14 degrees of level
constexpr std::size_t kMostPoints = 8;
constexpr double kAheadOfAnkle = 0.15;  // of a guessed sole's length
constexpr double kClearlyLonger = 1.1;  // in y: less is as good as square, and soles lie along x

struct Candidate {
  std::vector<Vector3d> points;
  Vector3d up = Vector3d::UnitZ();
  double radius_m = 0.0;  ///< the points are centres of balls
  [[nodiscard]] double lowest() const {
    double z = std::numeric_limits<double>::infinity();
    for (const Vector3d& p : points) z = std::min(z, p.z() - radius_m);
    return z;
  }
};

/// The four corners of the face that looks down most.
Candidate box(const Shape& shape, const model::Placement& at) {
  Candidate found;
  int down = 0;
  for (int i = 1; i < 3; ++i) {
    if (std::abs(at.R(2, i)) > std::abs(at.R(2, down))) down = i;
  }
  const double side = at.R(2, down) > 0.0 ? -0.5 : 0.5;
  found.up = at.R.col(down) * (side < 0.0 ? 1.0 : -1.0);
  const int a = (down + 1) % 3, b = (down + 2) % 3;
  for (const auto& [sa, sb] : {std::pair{0.5, 0.5}, {0.5, -0.5}, {-0.5, -0.5}, {-0.5, 0.5}}) {
    Vector3d corner = Vector3d::Zero();
    corner[down] = side * shape.size_m[down];
    corner[a] = sa * shape.size_m[a];
    corner[b] = sb * shape.size_m[b];
    found.points.push_back(at.R * corner + at.p);
  }
  return found;
}

/// The lower rim of an upright cylinder; the lowest line of one that lies.
Candidate cylinder(const Shape& shape, const model::Placement& at) {
  Candidate found;
  const double radius = shape.size_m.x(), half = 0.5 * shape.size_m.z();
  const Vector3d axis = at.R.col(2);
  if (std::abs(axis.z()) > std::numbers::sqrt2 / 2.0) {
    const Vector3d up = axis.z() > 0.0 ? axis : Vector3d(-axis);
    found.up = up;
    for (const auto& [x, y] : {std::pair{1.0, 0.0}, {0.0, 1.0}, {-1.0, 0.0}, {0.0, -1.0}}) {
      found.points.push_back(at.p - up * half + radius * (at.R.col(0) * x + at.R.col(1) * y));
    }
    return found;
  }
  const Vector3d under = (axis * axis.z() - Vector3d::UnitZ()).normalized() * radius;
  for (const double end : {half, -half}) found.points.push_back(at.p + axis * end + under);
  return found;
}

Candidate candidate(const Shape& shape, const model::Placement& link) {
  const model::Placement at = link * shape.in_link;
  switch (shape.kind) {
    case Shape::Kind::kBox: return box(shape, at);
    case Shape::Kind::kCylinder:
    case Shape::Kind::kCapsule: return cylinder(shape, at);
    case Shape::Kind::kSphere: return {{at.p}, Vector3d::UnitZ(), shape.size_m.x()};
    case Shape::Kind::kMesh: break;
  }
  return {};
}

/// Points that are the outermost of many in eight directions.
std::vector<Vector3d> outermost(const std::vector<Vector3d>& points) {
  if (points.size() <= kMostPoints) return points;
  std::vector<Vector3d> kept;
  for (std::size_t i = 0; i < kMostPoints; ++i) {
    const double angle = (0.5 + static_cast<double>(i)) * 2.0 * std::numbers::pi / kMostPoints;
    const Vector3d way(std::cos(angle), std::sin(angle), 0.0);
    const Vector3d best =
        *std::ranges::max_element(points, {}, [&](const Vector3d& p) { return p.dot(way); });
    if (std::ranges::find(kept, best) == kept.end()) kept.push_back(best);
  }
  return kept;
}

/// The upward normal of the plane that all points are in; z when they are in none, or nearly so.
Vector3d normal_of(const std::vector<Vector3d>& points) {
  Vector3d middle = Vector3d::Zero(), normal = Vector3d::Zero();
  for (const Vector3d& p : points) middle += p / static_cast<double>(points.size());
  for (const Vector3d& a : points) {
    for (const Vector3d& b : points) {
      const Vector3d n = (a - middle).cross(b - middle);
      if (n.norm() > normal.norm()) normal = n.z() < 0.0 ? Vector3d(-n) : n;
    }
  }
  if (!(normal.norm() > 1e-12)) return Vector3d::UnitZ();
  normal.normalize();
  if (normal.z() < kNearlyLevel || normal.head<2>().norm() < 1e-6) return Vector3d::UnitZ();
  const bool flat = std::ranges::all_of(
      points, [&](const Vector3d& p) { return std::abs(normal.dot(p - middle)) < kFlat_m; });
  return flat ? normal : Vector3d::UnitZ();
}

}  // namespace

ContactPatch lowest_points(const std::vector<Shape>& shapes,
                           const std::vector<model::Placement>& links) {
  std::vector<Candidate> all;
  for (std::size_t i = 0; i < shapes.size(); ++i) {
    Candidate one = candidate(shapes[i], links[i]);
    if (!one.points.empty()) all.push_back(std::move(one));
  }
  if (all.empty()) return {};
  const auto first = std::ranges::min_element(all, {}, &Candidate::lowest);
  const double ground = first->lowest();
  std::erase_if(all, [&](const Candidate& c) { return c.lowest() > ground + kSameLevel_m; });
  ContactPatch patch;
  if (all.size() == 1) {
    patch = {all[0].points, all[0].up, all[0].radius_m};
    return patch;
  }
  for (const Candidate& c : all) {
    for (Vector3d p : c.points) {
      p.z() -= c.radius_m;
      if (p.z() <= ground + kSameLevel_m) patch.points.push_back(p);
    }
  }
  patch.points = outermost(patch.points);
  patch.up = normal_of(patch.points);
  return patch;
}

ContactPatch equivalent_sole(const model::Inertia& in_w, const Vector3d& ankle, double scale_m) {
  const Eigen::Matrix3d& I = in_w.about_com_kg_m2;
  const double mass = std::max(in_w.mass_kg, 1e-9);
  Vector3d edge;
  for (int i = 0; i < 3; ++i) {
    edge[i] = std::sqrt(std::max(0.0, 6.0 * (I.trace() - 2.0 * I(i, i)) / mass));
  }
  const double length = std::clamp(std::max(edge.x(), edge.y()), 0.2 * scale_m, 0.4 * scale_m);
  const double width = std::clamp(std::min(edge.x(), edge.y()), 0.1 * scale_m, 0.2 * scale_m);
  const bool along_x = edge.y() < kClearlyLonger * edge.x();
  Vector3d middle = in_w.com_m;
  if (length < edge.head<2>().maxCoeff() || width < edge.head<2>().minCoeff()) {
    middle = ankle + Vector3d(kAheadOfAnkle * length, 0.0, 0.0);  // it fits no foot
  }
  const double bottom =
      std::clamp(ankle.z() - in_w.com_m.z() + 0.5 * edge.z(), 0.03 * scale_m, 0.15 * scale_m);
  ContactPatch patch;
  for (const auto& [a, b] : {std::pair{0.5, 0.5}, {0.5, -0.5}, {-0.5, -0.5}, {-0.5, 0.5}}) {
    patch.points.emplace_back(middle.x() + a * (along_x ? length : width),
                              middle.y() + b * (along_x ? width : length), ankle.z() - bottom);
  }
  return patch;
}

}  // namespace tandem::scaffold
