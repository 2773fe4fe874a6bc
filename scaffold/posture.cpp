// Zero within the limits, joints turned until gravity is light, and for a fixed base the most
// dexterous of 256 samples of Halton's series.
#include "scaffold/posture.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "model/symmetric_eigen.hpp"

namespace tandem::scaffold {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using model::Tree;

constexpr double kRoom = 0.05;        // of the range, kept to a limit
constexpr double kMostRoom = 0.1;     // [rad or m]
constexpr double kBelow = 10.0;       // more than all else that a posture is judged by
constexpr double kFarthest = 1.25;    // [rad]: from the middle of the limits, of a waiting posture
constexpr double kMostGravity = 0.5;  // of a joint's effort, by gravity alone
constexpr double kSparedLoad = 0.33;
constexpr double kSearchStep = 0.02;  // [rad]: in the search for less load
constexpr double kClear_m = 0.05;     // over the base's plane, of a waiting posture

/// The joints that a body's dexterity is judged by. Slides move it in their direction in every
/// posture, and hide that the joints that turn are stretched: they count where fewer than two turn.
std::vector<int> judged_by(const Posed& posed, const Tree& tree, int body) {
  const std::vector<int> path = tree.path_to(body);
  std::vector<int> turning = path;
  std::erase_if(turning, [&posed](int joint) { return posed.slides(joint); });
  return turning.size() < 2 ? path : turning;
}

/// The least velocity that a body's frame gets in its worst direction, per unit of joint speed
/// and reach; with fewer than three joints, in the directions that there are.
double dexterity(const Posed& posed, const Tree& tree, int body) {
  const MatrixXd all = posed.point_jacobian(body, posed.beyond(body - 1).com_m);
  const std::vector<int> path = judged_by(posed, tree, body);
  MatrixXd J(3, static_cast<Eigen::Index>(path.size()));
  for (std::size_t i = 0; i < path.size(); ++i) {
    J.col(static_cast<Eigen::Index>(i)) = all.col(path[i]);
  }
  const MatrixXd squares = J.cols() < 3 ? MatrixXd(J.transpose() * J) : MatrixXd(J * J.transpose());
  const double least = model::symmetric_eigenvalues(squares)[0];  // of the singular values' squares
  return std::sqrt(std::max(least, 0.0)) / std::max(J.norm(), 1e-9);
}

/// Gravity's share of the joint's effort; 0 when the description gives no effort.
double loaded(const Tree& tree, const Posed& posed, int joint) {
  const double effort = tree.joints[joint].effort;
  return effort > 0.0 ? std::abs(posed.gravity_load(joint)) / effort : 0.0;
}

}  // namespace

PositionRange position_range(const model::Joint& joint) {
  if (joint.type == model::JointType::kContinuous) return {joint.lower, joint.upper, false};
  if (joint.upper > joint.lower) return {joint.lower, joint.upper, false};
  const double span = joint.type == model::JointType::kPrismatic ? 0.1 : std::numbers::pi;
  if (std::isfinite(joint.lower)) return {joint.lower, joint.lower + 2.0 * span, true};
  if (std::isfinite(joint.upper)) return {joint.upper - 2.0 * span, joint.upper, true};
  return {-span, span, true};
}

std::vector<int> end_bodies(const Tree& tree) {
  std::vector<bool> carries(tree.bodies.size(), false);
  for (const model::Joint& joint : tree.joints) carries[joint.parent] = true;
  std::vector<int> ends;
  for (std::size_t b = 1; b < tree.bodies.size(); ++b) {
    if (!carries[b]) ends.push_back(static_cast<int>(b));
  }
  return ends;
}

double halton(int index, int dimension) {
  static constexpr std::array kPrimes{2,  3,  5,  7,  11, 13, 17, 19, 23, 29, 31, 37,
                                      41, 43, 47, 53, 59, 61, 67, 71, 73, 79, 83, 89};
  const int base = kPrimes[static_cast<std::size_t>(dimension) % kPrimes.size()];
  // More dimensions than primes: the same series, later.
  int i = index + 20 + 101 * (dimension / static_cast<int>(kPrimes.size()));
  double f = 1.0, r = 0.0;
  for (; i > 0; i /= base) {
    f /= base;
    r += f * (i % base);
  }
  return r;
}

Bounds bounds_of(const Tree& tree) {
  const auto n = static_cast<Eigen::Index>(tree.joints.size());
  Bounds bounds{VectorXd(n), VectorXd(n)};
  for (Eigen::Index j = 0; j < n; ++j) {
    const PositionRange range = position_range(tree.joints[j]);
    const double room = std::min(kRoom * (range.upper - range.lower), kMostRoom);
    bounds.lower[j] = std::max(range.lower + room, -std::numbers::pi);
    bounds.upper[j] = std::min(range.upper - room, std::numbers::pi);
    if (bounds.lower[j] > bounds.upper[j]) {  // limits beyond a turn
      bounds.lower[j] = range.lower + room;
      bounds.upper[j] = range.upper - room;
    }
  }
  return bounds;
}

VectorXd neutral_posture(const Tree& tree) {
  const Bounds bounds = bounds_of(tree);
  return VectorXd::Zero(bounds.lower.size()).cwiseMax(bounds.lower).cwiseMin(bounds.upper);
}

VectorXd spared_posture(const Tree& tree) {
  const Bounds bounds = bounds_of(tree);
  VectorXd q = neutral_posture(tree);
  for (int joint = static_cast<int>(tree.joints.size()) - 1; joint >= 0; --joint) {
    if (tree.joints[joint].follows()) continue;
    if (loaded(tree, Posed(tree, q), joint) <= kMostGravity) continue;
    double least = loaded(tree, Posed(tree, q), joint);
    double best = q[joint];
    for (int i = 2; least > kSparedLoad; ++i) {  // to either side, ever farther
      const int steps = i / 2;
      const double at = q[joint] + kSearchStep * (i % 2 == 0 ? steps : -steps);
      if (kSearchStep * steps > bounds.upper[joint] - bounds.lower[joint]) break;
      if (at < bounds.lower[joint] || at > bounds.upper[joint]) continue;
      VectorXd moved = q;
      moved[joint] = at;
      const double share = loaded(tree, Posed(tree, moved), joint);
      if (share >= least) continue;
      least = share;
      best = at;
    }
    q[joint] = best;
  }
  return q;
}

bool stands_on_its_base(const Tree& tree) {
  const Bounds bounds = bounds_of(tree);
  const Posed posed(tree, 0.5 * (bounds.lower + bounds.upper));
  model::Inertia moving;
  for (std::size_t j = 0; j < tree.joints.size(); ++j) {
    if (tree.joints[j].parent == 0) moving = moving + posed.beyond(static_cast<int>(j));
  }
  return moving.com_m.z() > 0.0;
}

VectorXd waiting_posture(const Tree& tree) {
  const Bounds bounds = bounds_of(tree);
  const VectorXd middle = 0.5 * (bounds.lower + bounds.upper);
  const VectorXd reach = (0.4 * (bounds.upper - bounds.lower)).cwiseMin(kFarthest);
  const std::vector<int> ends = end_bodies(tree);
  const bool floor = stands_on_its_base(tree);
  VectorXd best = middle;
  double best_score = -1e9;
  for (int sample = 0; sample < 256; ++sample) {
    VectorXd q = middle;
    double away = 0.0;
    for (Eigen::Index j = 0; j < q.size() && sample > 0; ++j) {
      const double share = 2.0 * halton(sample, static_cast<int>(j)) - 1.0;
      q[j] += share * reach[j];
      away += share * share / static_cast<double>(q.size());
    }
    const Posed posed(tree, q);
    double score = -0.05 * away;
    for (const int end : ends) {
      score += std::min(dexterity(posed, tree, end), 0.3) / static_cast<double>(ends.size());
    }
    for (std::size_t j = 0; j < tree.joints.size(); ++j) {
      if (tree.joints[j].follows()) continue;
      score -= std::max(0.0, loaded(tree, posed, static_cast<int>(j)) - kMostGravity);
    }
    const double below_m = floor ? kClear_m - posed.lowest_m() : 0.0;
    if (below_m > 0.0) score -= kBelow * (1.0 + below_m);
    if (score <= best_score) continue;
    best_score = score;
    best = q;
  }
  return best;
}

}  // namespace tandem::scaffold
