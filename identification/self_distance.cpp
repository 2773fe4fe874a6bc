#include "identification/self_distance.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>

#include "model/placements.hpp"

namespace tandem::identification {
namespace {

using Eigen::Vector3d;

/// The shortest distance of two segments (Ericson 2005, 5.1.9).
double segment_distance(const Vector3d& p1, const Vector3d& q1, const Vector3d& p2,
                        const Vector3d& q2) {
  const Vector3d d1 = q1 - p1, d2 = q2 - p2, r = p1 - p2;
  const double a = d1.squaredNorm(), e = d2.squaredNorm(), f = d2.dot(r), c = d1.dot(r);
  const double b = d1.dot(d2), denominator = a * e - b * b;
  double s = denominator > 1e-12 ? std::clamp((b * f - c * e) / denominator, 0.0, 1.0) : 0.0;
  double t = e > 1e-12 ? (b * s + f) / e : 0.0;
  if (t < 0.0 || t > 1.0) {
    t = std::clamp(t, 0.0, 1.0);
    s = a > 1e-12 ? std::clamp((b * t - c) / a, 0.0, 1.0) : 0.0;
  }
  return (p1 + s * d1 - p2 - t * d2).norm();
}

/// Half of the thinnest edge of the homogeneous box of this mass and inertia.
double half_thickness(const model::Inertia& inertia) {
  if (!(inertia.mass_kg > 0.0)) return 0.02;
  const Eigen::Matrix3d& I = inertia.about_com_kg_m2;
  const Eigen::Matrix3d S = 0.5 * I.trace() * Eigen::Matrix3d::Identity() - I;
  const double least = std::max(
      0.0,
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(S, Eigen::EigenvaluesOnly).eigenvalues()[0]);
  return std::clamp(std::sqrt(3.0 * least / inertia.mass_kg), 0.02, 0.08);
}

/// Bodies on the way from one to the other, both included.
int steps_between(const model::Tree& tree, int a, int b) {
  int steps = 0;
  while (a != b) {
    int& later = a > b ? a : b;
    later = tree.joints[static_cast<std::size_t>(later - 1)].parent;
    ++steps;
  }
  return steps;
}

}  // namespace

SelfDistance::SelfDistance(const model::Tree& tree, std::span<const double> start) : tree_(&tree) {
  for (std::size_t b = 0; b < tree.bodies.size(); ++b) {
    const auto body = static_cast<int>(b);
    const double radius = half_thickness(tree.bodies[b].inertia);
    bool carries = false;
    for (const model::Joint& joint : tree.joints) {
      if (joint.parent != body) continue;
      carries = true;
      capsules_.push_back({body, Vector3d::Zero(), joint.in_parent.p, radius});
    }
    if (!carries)
      capsules_.push_back({body, Vector3d::Zero(), 2.0 * tree.bodies[b].inertia.com_m, radius});
  }
  const std::vector<model::Placement> at = model::place_bodies(tree, start);
  for (std::size_t a = 0; a < capsules_.size(); ++a) {
    for (std::size_t b = a + 1; b < capsules_.size(); ++b) {
      const int steps = steps_between(tree, capsules_[a].body, capsules_[b].body);
      if (steps < 2) continue;  // they touch at their joint
      Pair pair{a, b, kRequired_m};
      const double now = distance(pair, at);
      if (steps == 2 && now < 2.0 * kRequired_m) continue;  // wrists and hips: always near
      if (now < 2.0 * kRequired_m) pair.required_m = now - 0.01;
      pairs_.push_back(pair);
    }
  }
}

double SelfDistance::distance(const Pair& pair, const std::vector<model::Placement>& at) const {
  const Capsule& a = capsules_[pair.a];
  const Capsule& b = capsules_[pair.b];
  const model::Placement& A = at[static_cast<std::size_t>(a.body)];
  const model::Placement& B = at[static_cast<std::size_t>(b.body)];
  return segment_distance(A.R * a.from + A.p, A.R * a.to + A.p, B.R * b.from + B.p,
                          B.R * b.to + B.p) -
         a.radius_m - b.radius_m;
}

double SelfDistance::room(std::span<const double> position) const {
  const std::vector<model::Placement> at = model::place_bodies(*tree_, position);
  double least = std::numeric_limits<double>::infinity();
  for (const Pair& pair : pairs_) least = std::min(least, distance(pair, at) - pair.required_m);
  return least;
}

}  // namespace tandem::identification
