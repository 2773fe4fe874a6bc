// The choice of the bodies' frames. A revolute joint leaves its body's frame free to turn about
// and slide along the joint's axis: candidates are listed per body, and dynamic programming over
// the tree picks the combination with the fewest operations, exactly.
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "model/mechanism.hpp"

namespace tandem::model {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kNoise = 1e-14;    // below this a constant is rounding noise
constexpr double kParallel = 1e-9;  // candidates only: nothing depends on it but their quality
constexpr double kFarthest = 2.0;   // shift of a frame along its axis, in reaches of its body

// Operations of one constant turn, of one component of a constant shift and of an offset.
constexpr double kTurnCost = 64.0;
constexpr double kShiftCost = 43.0;
constexpr double kOffsetCost = 1.0;
constexpr double kMomentCost = 4.0;

struct Line {
  Vector3d point;
  Vector3d direction;
};

// Joint `joint`'s axis in its own body's frame.
Line own_axis(const Tree& tree, std::size_t joint) {
  return {Vector3d::Zero(), tree.joints[joint].axis.normalized()};
}
// Joint `joint`'s axis in its parent body's frame, at q = 0.
Line axis_in_parent(const Tree& tree, std::size_t joint) {
  const Joint& j = tree.joints[joint];
  return {j.in_parent.p, j.in_parent.R * j.axis.normalized()};
}

// Distance along `a` from its point to the foot of the common normal with `b`; for parallel
// lines, to the foot of the perpendicular from b's point.
double foot(const Line& a, const Line& b) {
  const Vector3d n = a.direction.cross(b.direction);
  const Vector3d d = b.point - a.point;
  if (n.norm() < kParallel) return d.dot(a.direction);
  return d.cross(b.direction).dot(n) / n.squaredNorm();
}

// How far a body reaches from its own joint: to its centre of mass and to the joints that it
// carries, and as far as its joint is from the parent's.
double reach(const Tree& tree, std::size_t joint) {
  const Body& body = tree.bodies[joint + 1];
  double reach = tree.joints[joint].in_parent.p.norm();
  if (body.inertia.mass_kg > 0.0) reach = std::max(reach, body.inertia.com_m.norm());
  for (std::size_t child = joint + 1; child < tree.joints.size(); ++child)
    if (tree.joints[child].parent == static_cast<int>(joint) + 1)
      reach = std::max(reach, tree.joints[child].in_parent.p.norm());
  return reach;
}

Vector3d perpendicular(const Vector3d& v, const Vector3d& axis) { return v - v.dot(axis) * axis; }

void add_direction(std::vector<Vector3d>& list, const Vector3d& v, const Vector3d& axis) {
  const Vector3d x = perpendicular(v, axis);
  // Twice: of a short difference rounding leaves a part along the axis.
  if (x.norm() > kParallel) list.push_back(perpendicular(x.normalized(), axis).normalized());
}

Matrix3d frame_about(const Vector3d& z, const Vector3d& x) {
  Matrix3d R;
  R.col(0) = x;
  R.col(1) = z.cross(x);
  R.col(2) = z;
  return R;
}

bool known(const std::vector<Placement>& list, const Placement& candidate) {
  return std::any_of(list.begin(), list.end(), [&](const Placement& p) {
    return (p.R - candidate.R).norm() + (p.p - candidate.p).norm() < 1e-12;
  });
}

std::vector<Placement> candidates(const Tree& tree, std::size_t joint) {
  const Line axis = own_axis(tree, joint);
  const Joint& j = tree.joints[joint];
  const Vector3d& z = axis.direction;
  const Placement& in_parent = j.in_parent;
  std::vector<double> shifts{0.0};  // the first candidate is the description's own frame
  std::vector<Vector3d> directions;
  for (int k = 0; k < 3; ++k) add_direction(directions, Vector3d::Unit(k), z);
  if (j.parent > 0) {
    Line parent = own_axis(tree, static_cast<std::size_t>(j.parent) - 1);
    parent = {in_parent.R.transpose() * (parent.point - in_parent.p),
              in_parent.R.transpose() * parent.direction};
    shifts.push_back(foot(axis, parent));
    add_direction(directions, z.cross(parent.direction), z);
  }
  add_direction(directions, in_parent.R.transpose() * in_parent.p, z);
  shifts.push_back(-z.dot(in_parent.R.transpose() * in_parent.p));
  for (std::size_t child = joint + 1; child < tree.joints.size(); ++child) {
    if (tree.joints[child].parent != static_cast<int>(joint) + 1) continue;
    const Line other = axis_in_parent(tree, child);
    shifts.push_back(foot(axis, other));
    add_direction(directions, z.cross(other.direction), z);
    add_direction(directions, other.point, z);
  }
  // Axes that are almost parallel meet far away. A frame out there would cost all digits of the
  // inertia, so origins stay where the body is.
  const double farthest = kFarthest * reach(tree, joint);
  std::erase_if(shifts, [&](double shift) { return !(std::abs(shift) <= farthest); });
  std::vector<Placement> result;
  for (const double shift : shifts)
    for (const Vector3d& x : directions) {
      const Placement candidate{frame_about(z, x), shift * z};
      if (!known(result, candidate)) result.push_back(candidate);
    }
  return result;
}

double edge_cost(const Tree& tree, std::size_t joint, const Placement& parent,
                 const Placement& own) {
  const MechanismJoint frame = make_joint(tree.joints[joint], parent, own);
  double cost = kTurnCost * static_cast<double>(frame.in_parent.R.turns.size());
  for (const double p : frame.in_parent.p) cost += p != 0.0 ? kShiftCost : 0.0;
  if (frame.cos_offset != 0.0 && frame.sin_offset != 0.0) cost += kOffsetCost;
  const Body& body = tree.bodies[joint + 1];
  const Vector3d com = own.R.transpose() * (body.inertia.com_m - own.p);
  for (int k = 0; k < 2; ++k) cost += std::abs(com[k]) > kNoise ? kMomentCost : 0.0;
  return cost;
}

// Candidates of one body's frame, and the least that its subtree costs with each.
struct Choice {
  std::vector<Placement> candidates;
  std::vector<double> subtree_cost;
};

}  // namespace

std::vector<Placement> described_frames(const Tree& tree) {
  std::vector<Placement> result{Placement{}};
  for (std::size_t j = 0; j < tree.joints.size(); ++j)
    result.push_back(candidates(tree, j).front());
  return result;
}

std::vector<Placement> align_frames(const Tree& tree) {
  const std::size_t count = tree.joints.size();
  std::vector<Choice> choice(count + 1);
  choice[0] = {{Placement{}}, {0.0}};
  for (std::size_t j = 0; j < count; ++j) {
    choice[j + 1].candidates = candidates(tree, j);
    choice[j + 1].subtree_cost.assign(choice[j + 1].candidates.size(), 0.0);
  }
  std::vector<std::vector<std::size_t>> best_of_parent(count);
  for (std::size_t j = count; j-- > 0;) {
    Choice& parent = choice[static_cast<std::size_t>(tree.joints[j].parent)];
    const Choice& own = choice[j + 1];
    for (std::size_t p = 0; p < parent.candidates.size(); ++p) {
      double best = std::numeric_limits<double>::infinity();
      std::size_t best_index = 0;
      for (std::size_t c = 0; c < own.candidates.size(); ++c) {
        const double cost =
            own.subtree_cost[c] + edge_cost(tree, j, parent.candidates[p], own.candidates[c]);
        if (cost < best - 1e-9) {
          best = cost;
          best_index = c;
        }
      }
      best_of_parent[j].push_back(best_index);
      parent.subtree_cost[p] += best;
    }
  }
  std::vector<Placement> result{Placement{}};
  std::vector<std::size_t> chosen{0};
  for (std::size_t j = 0; j < count; ++j) {
    chosen.push_back(best_of_parent[j][chosen[static_cast<std::size_t>(tree.joints[j].parent)]]);
    result.push_back(choice[j + 1].candidates[chosen.back()]);
  }
  return result;
}

}  // namespace tandem::model
