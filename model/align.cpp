// The choice of the bodies' frames. A revolute joint leaves its body's frame free to turn about
// and slide along the joint's axis: candidates are listed per body, and dynamic programming over
// the tree picks the combination with the fewest operations, exactly.
#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "model/limbs.hpp"
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
constexpr double kMismatchCost = 200.0;  // of a constant that is zero in one of two limbs
constexpr double kZero = 1e-13;

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

// What a joint's constants are but for their signs.
std::array<double, 15> sizes_of(const Tree& tree, std::size_t joint, const Placement& parent,
                                const Placement& own) {
  const Placement in_parent = tree.joints[joint].in_parent * own;
  const Matrix3d R = parent.R.transpose() * in_parent.R;
  const Vector3d p = parent.R.transpose() * (in_parent.p - parent.p);
  const Vector3d com = own.R.transpose() * (tree.bodies[joint + 1].inertia.com_m - own.p);
  std::array<double, 15> sizes;
  for (int k = 0; k < 9; ++k) sizes[static_cast<std::size_t>(k)] = std::abs(R(k / 3, k % 3));
  for (std::size_t k = 0; k < 3; ++k) {
    sizes[9 + k] = std::abs(p[static_cast<int>(k)]);
    sizes[12 + k] = std::abs(com[static_cast<int>(k)]);
  }
  return sizes;
}

// How far two joints are from taking the same operations: a constant that is zero in one of them
// only costs what it costs there.
double mismatch(const std::array<double, 15>& a, const std::array<double, 15>& b) {
  double sum = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    const bool differs = (a[i] > kZero) != (b[i] > kZero);
    sum += (differs ? kMismatchCost : 0.0) + kMismatchCost * 1e-3 * std::abs(a[i] - b[i]);
  }
  return sum;
}

// Frames of a second limb whose numbers are those of the first one's but for their signs, as far as
// there are such: then the same operations serve both.
struct Matched {
  std::vector<Placement> frames;  // by joint of the limb
  double mismatch = 0.0;
};
Matched match_frames(const Tree& tree, const LimbPair& limbs, const Placement& parent,
                     const std::vector<Placement>& first) {
  Matched result;
  const auto parent_in = [&](const std::vector<int>& limb, const std::vector<Placement>& frames,
                             int joint) {
    const int body = tree.joints[static_cast<std::size_t>(joint)].parent;
    const auto found = std::find(limb.begin(), limb.end(), body - 1);
    return found == limb.end() ? parent : frames[static_cast<std::size_t>(found - limb.begin())];
  };
  for (std::size_t k = 0; k < limbs.first.size(); ++k) {
    const auto wanted = sizes_of(tree, static_cast<std::size_t>(limbs.first[k]),
                                 parent_in(limbs.first, first, limbs.first[k]), first[k]);
    const auto second = static_cast<std::size_t>(limbs.second[k]);
    const Placement above = parent_in(limbs.second, result.frames, limbs.second[k]);
    double least = std::numeric_limits<double>::infinity();
    Placement best;
    for (const Placement& candidate : candidates(tree, second)) {
      const double found = mismatch(wanted, sizes_of(tree, second, above, candidate));
      if (found >= least - 1e-9) continue;
      least = found;
      best = candidate;
    }
    result.frames.push_back(best);
    result.mismatch += least;
  }
  return result;
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

namespace {

class Alignment {
 public:
  explicit Alignment(const Tree& tree)
      : tree_(tree),
        limbs_(find_limb_pairs(tree)),
        choice_(tree.joints.size() + 1),
        best_of_parent_(tree.joints.size()),
        cost_of_parent_(tree.joints.size()) {
    choice_[0] = {{Placement{}}, {0.0}};
    for (std::size_t j = 0; j < tree.joints.size(); ++j) {
      choice_[j + 1].candidates = candidates(tree, j);
      choice_[j + 1].subtree_cost.assign(choice_[j + 1].candidates.size(), 0.0);
    }
  }

  std::vector<Placement> run() {
    for (std::size_t j = tree_.joints.size(); j-- > 0;) {
      find_best(j);
      add_to_parent(j);
    }
    frames_.assign(tree_.joints.size() + 1, Placement{});
    chosen_.assign(tree_.joints.size() + 1, 0);
    for (std::size_t j = 0; j < tree_.joints.size(); ++j) take_best(j);
    for (const LimbPair& limbs : limbs_) match(limbs);
    return std::move(frames_);
  }

 private:
  std::size_t parent_of(std::size_t joint) const {
    return static_cast<std::size_t>(tree_.joints[joint].parent);
  }

  // For each frame of its parent: the joint's own with the cheapest subtree.
  void find_best(std::size_t j) {
    const Choice& own = choice_[j + 1];
    for (const Placement& parent : choice_[parent_of(j)].candidates) {
      double best = std::numeric_limits<double>::infinity();
      std::size_t best_index = 0;
      for (std::size_t c = 0; c < own.candidates.size(); ++c) {
        const double cost = own.subtree_cost[c] + edge_cost(tree_, j, parent, own.candidates[c]);
        if (cost < best - 1e-9) {
          best = cost;
          best_index = c;
        }
      }
      best_of_parent_[j].push_back(best_index);
      cost_of_parent_[j].push_back(best);
    }
  }

  // A limb whose frames match those of the one that it is paired with costs what does not match.
  void add_to_parent(std::size_t j) {
    Choice& parent = choice_[parent_of(j)];
    const LimbPair* pair = nullptr;
    for (const LimbPair& limbs : limbs_) {
      if (limbs.second.front() == static_cast<int>(j)) return;  // added with the first
      if (limbs.first.front() == static_cast<int>(j)) pair = &limbs;
    }
    for (std::size_t p = 0; p < parent.candidates.size(); ++p) {
      parent.subtree_cost[p] += cost_of_parent_[j][p];
      if (pair == nullptr) continue;
      const double own = cost_of_parent_[static_cast<std::size_t>(pair->second.front())][p];
      const Matched matched =
          match_frames(tree_, *pair, parent.candidates[p], first_frames(*pair, p));
      parent.subtree_cost[p] += std::min(own, matched.mismatch);
    }
  }

  // The best frames of the first limb, with that frame of its parent.
  std::vector<Placement> first_frames(const LimbPair& pair, std::size_t parent_frame) const {
    std::vector<Placement> frames;
    std::vector<std::size_t> chosen;
    for (const int joint : pair.first) {
      const auto j = static_cast<std::size_t>(joint);
      const auto above =
          std::find(pair.first.begin(), pair.first.end(), tree_.joints[j].parent - 1);
      const bool is_root = above == pair.first.end();
      const std::size_t p =
          is_root ? parent_frame : chosen[static_cast<std::size_t>(above - pair.first.begin())];
      chosen.push_back(best_of_parent_[j][p]);
      frames.push_back(choice_[j + 1].candidates[chosen.back()]);
    }
    return frames;
  }

  void take_best(std::size_t j) {
    chosen_[j + 1] = best_of_parent_[j][chosen_[parent_of(j)]];
    frames_[j + 1] = choice_[j + 1].candidates[chosen_[j + 1]];
  }

  void match(const LimbPair& limbs) {
    const std::size_t body = parent_of(static_cast<std::size_t>(limbs.first.front()));
    const Matched matched =
        match_frames(tree_, limbs, frames_[body], first_frames(limbs, chosen_[body]));
    const auto second = static_cast<std::size_t>(limbs.second.front());
    if (matched.mismatch > cost_of_parent_[second][chosen_[body]]) return;
    for (std::size_t k = 0; k < limbs.second.size(); ++k)
      frames_[static_cast<std::size_t>(limbs.second[k]) + 1] = matched.frames[k];
  }

  const Tree& tree_;
  std::vector<LimbPair> limbs_;
  std::vector<Choice> choice_;                            // per body
  std::vector<std::vector<std::size_t>> best_of_parent_;  // per joint and frame of its parent
  std::vector<std::vector<double>> cost_of_parent_;       // the same
  std::vector<Placement> frames_;
  std::vector<std::size_t> chosen_;
};

}  // namespace

std::vector<Placement> align_frames(const Tree& tree) { return Alignment(tree).run(); }

}  // namespace tandem::model
