// Damped least squares on the legs' joints for soles, centre of mass and height; knee patterns are
// tried in order of likelihood.
#include "scaffold/standing.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>

namespace tandem::scaffold {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;
using model::Placement;
using model::Tree;

constexpr double kTurnWeight_m = 0.3;  // a sole's tilt of 1 rad counts as so many metres
constexpr double kBend_rad = 0.7;      // of the knees, where the search begins
constexpr std::array kHeightShares{0.94, 0.96, 0.98};  // of the greatest height, by preference
constexpr double kLooseWeight = 0.03;                  // of the centre of mass beside the feet
constexpr double kBeside_m = 0.02;                     // the most that it may then be
constexpr double kMiddleHalf = 0.5;                    // of a sole: where the centre of mass may be
constexpr std::size_t kMostLegs = 4;                   // whose knees are tried every way
constexpr double kHeightRatio = 1.02;  // ratio of heights in the search for the greatest
constexpr double kConverged_m = 1e-6;
constexpr double kLongestStep = 0.3;  // [rad or m]
constexpr int kIterations = 60;
constexpr int kHeights = 25;  // about the bent posture's, where the search begins
constexpr int kSamples = 64;

}  // namespace

StandingPosture::StandingPosture(const Tree& tree, const std::vector<FoundFoot>& feet,
                                 const Vector3d& ahead, VectorXd start)
    : tree_(tree), feet_(feet), bounds_(bounds_of(tree)), neutral_(std::move(start)) {
  level_ << ahead, Vector3d::UnitZ().cross(ahead), Vector3d::UnitZ();
  in_leg_.assign(tree.joints.size(), false);
  const Posed neutral(tree, neutral_);
  for (const FoundFoot& foot : feet_) {
    for (const int j : tree.path_to(foot.body)) in_leg_[j] = true;
    lines_.push_back(levels_line(foot, neutral));
    Vector3d home = (neutral.link(foot.link) * foot.sole_in_link).p;
    const Knee knee = knee_of(foot);
    if (!foot.flat() && knee.hip >= 0) {  // a point foot stands under its hip
      home += ahead * ahead.dot(neutral.origin(knee.hip) - home);
    }
    homes_.push_back(home);
    middle_home_ += (home + best_load(foot, neutral)) / static_cast<double>(feet_.size());
  }
  q_ = neutral_;
}

/// Place takes two of the joints that tilt a line, so it needs a third one.
bool StandingPosture::levels_line(const FoundFoot& foot, const Posed& neutral) const {
  const Vector3d line = (neutral.link(foot.link) * foot.sole_in_link).R * foot.line();
  if (!(line.norm() > 0.0)) return false;
  const Vector3d about = Vector3d::UnitZ().cross(line).normalized();
  const std::vector<int> path = tree_.path_to(foot.body);
  return std::ranges::count_if(path, [&](int j) {
           return !neutral.slides(j) && std::abs(neutral.axis(j).dot(about)) > 0.7;
         }) > 2;
}

int StandingPosture::conditions(std::size_t foot) const {
  if (feet_[foot].flat()) return 6;
  return lines_[foot] ? 4 : 3;
}

/// From the sole's middle to where a load asks least of the ankle: under it, as far as that is
/// in the sole's middle half.
Vector3d StandingPosture::best_load(const FoundFoot& foot, const Posed& neutral) const {
  if (!foot.flat()) return Vector3d::Zero();
  const Placement sole = neutral.link(foot.link) * foot.sole_in_link;
  Vector3d most = Vector3d::Zero();
  for (const Vector3d& p : foot.points) most = most.cwiseMax(p.cwiseAbs());
  Vector3d way = sole.R.transpose() * (neutral.origin(foot.body - 1) - sole.p);
  way = way.cwiseMax(-kMiddleHalf * most).cwiseMin(kMiddleHalf * most);
  way.z() = 0.0;
  return sole.R * way;
}

/// Finds the knee: of the joints that bend the leg in its own plane, the one that is far from both
/// the first of them and the foot.
StandingPosture::Knee StandingPosture::knee_of(const FoundFoot& foot) const {
  const Posed neutral(tree_, neutral_);
  const Vector3d left = level_.col(1);
  const Vector3d sole = (neutral.link(foot.link) * foot.sole_in_link).p;
  std::vector<int> pitch;
  for (const int j : tree_.path_to(foot.body)) {
    if (!neutral.slides(j) && std::abs(neutral.axis(j).dot(left)) > 0.7) pitch.push_back(j);
  }
  Knee found;
  double best = 0.0;
  for (std::size_t i = 1; i < pitch.size(); ++i) {
    const Vector3d at = neutral.origin(pitch[i]);
    const double far = std::min((at - neutral.origin(pitch[0])).norm(), (at - sole).norm());
    if (far <= best) continue;
    best = far;
    found.hip = pitch[i - 1];
    found.knee = pitch[i];
    found.ankle = i + 1 < pitch.size() ? pitch[i + 1] : -1;
  }
  found.front = level_.col(0).dot(sole - neutral.whole().com_m) >= 0.0;
  return found;
}

std::vector<int> StandingPosture::hip_and_knee() const {
  const Knee knee = knee_of(feet_.front());
  return knee.knee < 0 ? std::vector<int>{} : std::vector<int>{knee.hip, knee.knee};
}

/// Knees bent: +1 points them ahead, -1 back.
VectorXd StandingPosture::bent(const std::vector<double>& sides) const {
  const Posed neutral(tree_, neutral_);
  VectorXd q = neutral_;
  for (std::size_t f = 0; f < feet_.size(); ++f) {
    const Knee knee = knee_of(feet_[f]);
    if (knee.knee < 0) continue;
    const double side = sides[f];
    const auto turn = [&](int joint, double angle) {
      if (joint < 0) return;
      q[joint] = neutral.axis(joint).dot(level_.col(1)) > 0.0 ? angle : -angle;
    };
    turn(knee.knee, side * kBend_rad);
    turn(knee.hip, -0.5 * side * kBend_rad);
    turn(knee.ankle, -0.5 * side * kBend_rad);
  }
  return q.cwiseMax(bounds_.lower).cwiseMin(bounds_.upper);
}

/// Which way each knee may point, the likeliest first: a biped's ahead, a quadruped's to its
/// middle; then all that are left.
std::vector<std::vector<double>> StandingPosture::patterns() const {
  std::vector<std::vector<double>> found;
  using Pair = std::pair<double, double>;  // of the front and of the hind legs
  for (const auto& [front, hind] : feet_.size() > 2
                                       ? std::vector<Pair>{{-1, 1}, {-1, -1}, {1, 1}, {1, -1}}
                                       : std::vector<Pair>{{1, 1}, {-1, -1}}) {
    std::vector<double> sides;
    for (const FoundFoot& foot : feet_) sides.push_back(knee_of(foot).front ? front : hind);
    found.push_back(std::move(sides));
  }
  for (unsigned bits = 0; feet_.size() <= kMostLegs && bits < 1U << feet_.size(); ++bits) {
    std::vector<double> sides;
    for (std::size_t f = 0; f < feet_.size(); ++f) sides.push_back((bits >> f & 1U) != 0 ? -1 : 1);
    if (std::ranges::find(found, sides) == found.end()) found.push_back(std::move(sides));
  }
  return found;
}

/// Each foot's way to where it has to be, under a centre of mass that moves with the legs; and
/// how it changes with the joints. Loose: about the feet's own middle, whose way to the centre of
/// mass counts little.
double StandingPosture::residual(const Posed& posed, double height_m, VectorXd& r,
                                 MatrixXd* J) const {
  Eigen::Index rows = 0;
  for (std::size_t f = 0; f < feet_.size(); ++f) rows += conditions(f);
  if (loose_) rows += 2;
  r.resize(rows);
  if (J != nullptr) J->setZero(rows, static_cast<Eigen::Index>(tree_.joints.size()));
  Vector3d com = posed.whole().com_m;
  MatrixXd way;  // of `com`
  if (J != nullptr) way = posed.com_jacobian();
  Eigen::Index at = 0;
  if (loose_) {
    Vector3d middle = Vector3d::Zero();
    MatrixXd turn = MatrixXd::Zero(3, static_cast<Eigen::Index>(tree_.joints.size()));
    const double share = 1.0 / static_cast<double>(feet_.size());
    for (std::size_t f = 0; f < feet_.size(); ++f) {
      const Vector3d sole = (posed.link(feet_[f].link) * feet_[f].sole_in_link).p;
      middle += share * (sole - homes_[f] + middle_home_);
      if (J != nullptr) turn += share * posed.point_jacobian(feet_[f].body, sole);
    }
    r.head<2>() = kLooseWeight * (com - middle).head<2>();
    if (J != nullptr) J->topRows<2>() = kLooseWeight * (turn - way).topRows<2>();
    com = middle;
    way = turn;
    at = 2;
  }
  if (J != nullptr) way.row(2).setZero();
  for (std::size_t f = 0; f < feet_.size(); ++f) {
    const FoundFoot& foot = feet_[f];
    const Placement sole = posed.link(foot.link) * foot.sole_in_link;
    Vector3d target = homes_[f] + com - middle_home_;
    target.z() = -height_m + foot.radius_m;
    r.segment<3>(at) = target - sole.p;
    if (J != nullptr) {
      J->middleRows<3>(at) = posed.point_jacobian(foot.body, sole.p) - way;
    }
    at += 3;
    if (lines_[f]) {
      const Vector3d line = (sole.R * foot.line()).normalized();
      r[at] = -kTurnWeight_m * line.z();
      if (J != nullptr) {
        const MatrixXd turn = posed.turn_jacobian(foot.body);
        J->row(at) = kTurnWeight_m * (line.y() * turn.row(0) - line.x() * turn.row(1));
      }
      ++at;
    }
    if (!foot.flat()) continue;
    Vector3d turn = Vector3d::Zero();
    for (int i = 0; i < 3; ++i) turn += 0.5 * Vector3d(sole.R.col(i)).cross(level_.col(i));
    r.segment<3>(at) = kTurnWeight_m * turn;
    if (J != nullptr) J->middleRows<3>(at) = kTurnWeight_m * posed.turn_jacobian(foot.body);
    at += 3;
  }
  return r.norm();
}

/// The smallest step of the legs' joints that leads there; joints that would leave their limits
/// stay, and the others do without them.
VectorXd StandingPosture::leg_step(MatrixXd J, const VectorXd& r, double damping,
                                   const VectorXd& q) const {
  for (Eigen::Index j = 0; j < J.cols(); ++j) {
    if (!in_leg_[j]) J.col(j).setZero();
  }
  VectorXd step;
  for (bool again = true; again;) {
    again = false;
    const MatrixXd normal = J * J.transpose() + damping * MatrixXd::Identity(r.size(), r.size());
    step = J.transpose() * normal.ldlt().solve(r);
    for (Eigen::Index j = 0; j < J.cols(); ++j) {
      const bool out = (q[j] <= bounds_.lower[j] && step[j] < 0.0) ||
                       (q[j] >= bounds_.upper[j] && step[j] > 0.0);
      if (!out) continue;
      J.col(j).setZero();
      again = true;
    }
  }
  if (const double most = step.cwiseAbs().maxCoeff(); most > kLongestStep) {
    step *= kLongestStep / most;
  }
  return step;
}

/// Damped least squares: the smallest step of the legs' joints that leads there, cut to the
/// limits. From where `q` is, and always the same.
bool StandingPosture::solve(double height_m, VectorXd& q) const {
  VectorXd r;
  MatrixXd J;
  VectorXd best = q;
  double damping = 1e-4;
  double error = residual(Posed(tree_, best), height_m, r, &J);
  for (int i = 0; i < kIterations && error > kConverged_m; ++i) {
    const VectorXd step = leg_step(J, r, damping, best);
    const VectorXd next = (best + step).cwiseMax(bounds_.lower).cwiseMin(bounds_.upper);
    VectorXd r_next;
    const double reached = residual(Posed(tree_, next), height_m, r_next, nullptr);
    if (reached < error) {
      best = next;
      damping = std::max(damping * 0.1, 1e-12);
      error = residual(Posed(tree_, best), height_m, r, &J);
    } else {
      damping *= 10.0;
      if (damping > 1e3) break;
    }
  }
  q = best;
  if (!loose_) return error < 100.0 * kConverged_m;
  return r.tail(r.size() - 2).norm() < 100.0 * kConverged_m &&
         r.head<2>().norm() < kLooseWeight * kBeside_m;
}

/// From a bent posture up until the feet leave the ground, and down again to a share of that.
bool StandingPosture::settle(VectorXd q) {
  const Posed start(tree_, q);
  double height = 0.0;
  for (const FoundFoot& foot : feet_) {
    height += (foot.radius_m - (start.link(foot.link) * foot.sole_in_link).p.z()) /
              static_cast<double>(feet_.size());
  }
  if (height <= 0.0) return false;
  const VectorXd bent = q;
  for (int i = 0;; ++i) {  // at this height, a little higher, a little lower, …
    if (i == kHeights) return false;
    const int steps = i % 2 == 0 ? -i / 2 : (i + 1) / 2;
    q = bent;
    if (!solve(height * std::pow(kHeightRatio, steps), q)) continue;
    height *= std::pow(kHeightRatio, steps);
    break;
  }
  VectorXd high = q;
  greatest_m_ = height_m_ = height;
  q_ = q;
  for (int i = 0; i < 100 && solve(greatest_m_ * kHeightRatio, high); ++i)
    greatest_m_ *= kHeightRatio;
  for (const double share : kHeightShares) {
    VectorXd found = q;
    if (!solve(share * greatest_m_, found)) continue;
    height_m_ = share * greatest_m_;
    q_ = found;
    break;
  }
  return true;
}

/// Legs that have fewer joints than their feet have conditions cannot fulfil all of them.
bool StandingPosture::lacks_joints() const {
  std::ptrdiff_t needed = 0;
  for (std::size_t f = 0; f < feet_.size(); ++f) needed += conditions(f);
  return std::ranges::count(in_leg_, true) < needed;
}

bool StandingPosture::search() {
  for (const std::vector<double>& sides : patterns()) {
    if (settle(bent(sides))) return true;
  }
  for (int sample = 0; sample < kSamples; ++sample) {
    VectorXd q = neutral_;
    for (Eigen::Index j = 0; j < q.size(); ++j) {
      const double low = std::max(bounds_.lower[j], -1.0), high = std::min(bounds_.upper[j], 1.0);
      if (in_leg_[j] && low < high) q[j] = low + (high - low) * halton(sample, static_cast<int>(j));
    }
    if (settle(q)) return true;
  }
  return false;
}

Status StandingPosture::find() {
  loose_ = lacks_joints();
  if (search()) return {};
  if (!loose_) {
    loose_ = true;
    if (search()) return {};
  }
  return fail("no posture was found in which the robot stands level on its feet",
              "give --base fixed, and edit what is written");
}

double StandingPosture::beside_m() const {
  if (!loose_) return 0.0;
  VectorXd r;
  static_cast<void>(residual(Posed(tree_, q_), height_m_, r, nullptr));
  return r.head<2>().norm() / kLooseWeight;
}

void StandingPosture::stay_on(const std::vector<FoundFoot>& settled) {
  feet_ = settled;
  const Posed posed(tree_, q_);
  for (std::size_t f = 0; f < feet_.size(); ++f) {
    homes_[f] = (posed.link(feet_[f].link) * feet_[f].sole_in_link).p;
  }
  middle_home_ = posed.whole().com_m;
}

Result<VectorXd> StandingPosture::lowered(const VectorXd& q, double down_m) const {
  VectorXd found = q;
  if (solve(height_m_ - down_m, found)) return found;
  return fail("the legs cannot lower the robot so far");
}

}  // namespace tandem::scaffold
