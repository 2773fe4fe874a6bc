// Subtrees are compared from their first joints to their tips; of several that are alike those
// that differ least become a pair.
#include "model/limbs.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace tandem::model {
namespace {

constexpr double kAlike = 0.1;      // relative difference of two masses
constexpr double kShort_m = 1e-3;   // a length that makes no difference
constexpr double kLight_kg = 1e-3;  // nor does such a mass
constexpr double kPattern = 0.01;   // of a constant that is zero in one of two joints
constexpr double kVanishes = 1e-13;
constexpr double kTie = 1e-6;  // the first one then
constexpr double kUnlike = std::numeric_limits<double>::infinity();

double difference(double a, double b, double small) {
  return std::abs(a - b) / (std::max(std::abs(a), std::abs(b)) + small);
}

class Comparison {
 public:
  explicit Comparison(const Tree& tree) : tree_(tree), children_(tree.bodies.size()) {
    for (std::size_t j = 0; j < tree.joints.size(); ++j)
      children_[static_cast<std::size_t>(tree.joints[j].parent)].push_back(static_cast<int>(j));
  }

  std::vector<LimbPair> pairs() {
    look_at(0);
    return std::move(pairs_);
  }

 private:
  const std::vector<int>& children_of(int joint) const {
    return children_[static_cast<std::size_t>(joint) + 1];
  }
  const Joint& joint(int index) const { return tree_.joints[static_cast<std::size_t>(index)]; }
  const Inertia& inertia(int index) const {
    return tree_.bodies[static_cast<std::size_t>(index) + 1].inertia;
  }

  /// Difference of two joints and their bodies.
  double difference_here(int a, int b) const {
    const bool slides = joint(a).type == JointType::kPrismatic;
    if (slides != (joint(b).type == JointType::kPrismatic)) return kUnlike;
    if (joint(a).follows() || joint(b).follows()) return kUnlike;
    const Inertia& x = inertia(a);
    const Inertia& y = inertia(b);
    const double masses = difference(x.mass_kg, y.mass_kg, kLight_kg);
    if (masses > kAlike) return kUnlike;
    return masses + difference(x.com_m.norm(), y.com_m.norm(), kShort_m) +
           difference(joint(a).in_parent.p.norm(), joint(b).in_parent.p.norm(), kShort_m) +
           kPattern * zeros_in_one(joint(a).in_parent, joint(b).in_parent);
  }

  static int zeros_in_one(const Placement& a, const Placement& b) {
    int count = 0;
    const auto look = [&](double x, double y) {
      count += (std::abs(x) > kVanishes) != (std::abs(y) > kVanishes) ? 1 : 0;
    };
    for (int k = 0; k < 9; ++k) look(a.R(k / 3, k % 3), b.R(k / 3, k % 3));
    for (int k = 0; k < 3; ++k) look(a.p[k], b.p[k]);
    return count;
  }

  /// Difference of the subtrees behind two joints; where they are alike `pair` gets their joints.
  double difference_of(int a, int b, LimbPair& pair) const {
    double sum = difference_here(a, b);
    if (sum == kUnlike || children_of(a).size() != children_of(b).size()) return kUnlike;
    pair.first.push_back(a);
    pair.second.push_back(b);
    std::vector<int> left = children_of(b);
    for (const int child : children_of(a)) {
      double least = kUnlike;
      LimbPair best;
      int chosen = -1;
      for (const int other : left) {
        LimbPair below;
        const double found = difference_of(child, other, below);
        if (found >= least - kTie) continue;
        least = found;
        best = std::move(below);
        chosen = other;
      }
      if (chosen < 0) return kUnlike;
      std::erase(left, chosen);
      pair.first.insert(pair.first.end(), best.first.begin(), best.first.end());
      pair.second.insert(pair.second.end(), best.second.begin(), best.second.end());
      sum += least;
    }
    return sum;
  }

  /// Pairs the subtrees that start at a body, the most alike first; looks on in what is left.
  void look_at(std::size_t body) {
    std::vector<int> left = children_[body];
    while (true) {
      double least = kUnlike;
      LimbPair best;
      for (std::size_t i = 0; i < left.size(); ++i) {
        for (std::size_t k = i + 1; k < left.size(); ++k) {
          LimbPair pair;
          const double found = difference_of(left[i], left[k], pair);
          if (found >= least - kTie) continue;
          least = found;
          best = std::move(pair);
        }
      }
      if (best.first.empty()) break;
      std::erase(left, best.first.front());
      std::erase(left, best.second.front());
      pairs_.push_back(std::move(best));
    }
    for (const int joint : left) look_at(static_cast<std::size_t>(joint) + 1);
  }

  const Tree& tree_;
  std::vector<std::vector<int>> children_;  // per body
  std::vector<LimbPair> pairs_;
};

}  // namespace

std::vector<LimbPair> find_limb_pairs(const Tree& tree) { return Comparison(tree).pairs(); }

}  // namespace tandem::model
