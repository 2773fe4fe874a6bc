// A candidate is a random series, made smaller until it keeps every limit; the search compares the
// conditions of their regressors.
#include "identification/excite.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

#include "base/nearest.hpp"
#include "base/split_mix.hpp"
#include "identification/identify.hpp"
#include "identification/self_distance.hpp"
#include "identification/standing.hpp"

namespace tandem::identification {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr int kSamples = 160;           // of a period, for limits
constexpr int kMeasured = 60;           // of them, for the condition
constexpr double kPositionShare = 0.9;  // of the way from the start to a limit
constexpr double kFreeTurn_rad = 2.0;   // of a joint without limits
constexpr double kBalance_m = 0.04;
constexpr double kSwayingShare = 0.5;  // of the speeds that an arm has: what stands or hangs sways
constexpr double kFreeFeet_m = 0.15;   // of a robot that hangs: above the ground
constexpr double kSlip = 0.25;
constexpr double kLeastShare = 0.4;  // a foot that carries little may swing on its spring
constexpr double kStep_s = 1e-3;     // of the base's differences
constexpr int kLegHarmonics = 3;     // times those of the base

/// How far the base goes at most, before limits: [m] and [rad].
const BasePose& base_reach() {
  static const BasePose reach{0.02, 0.025, 0.06, 0.08, 0.08, 0.12};
  return reach;
}

/// All there is at an instant of a candidate.
struct Moment {
  Instant instant;
  BasePose pose = BasePose::Zero();
};

/// One candidate: a series of the base's pose (standing) and of the free coordinates; what the legs
/// do follows.
struct Candidate {
  ExcitingSeries base;   // (6), of a robot that stands
  ExcitingSeries free;   // of the coordinates that move by themselves
  ExcitingSeries whole;  // of all coordinates
  Excitation figures;
  double condition = std::numeric_limits<double>::infinity();
};

class Search {
 public:
  Search(const hal::RobotConfig& robot, const model::Tree& tree, IdentifiedRobot& identified,
         Regressor whole_body, const ExciteRequest& request, VectorXd start,
         std::vector<Index> free)
      : robot_(robot),
        tree_(tree),
        identified_(identified),
        whole_body_(std::move(whole_body)),
        request_(request),
        start_(std::move(start)),
        distance_(tree, spread(start_)),
        base_(structural_base(identified, tree, request.hung)),
        seed_(request.seed) {
    if (tree.floating_base) feet_.emplace(tree, robot, identified.regressor, start_);
    if (stands())
      for (const Index c : feet_->leg_coordinates()) std::erase(free, c);
    free_ = std::move(free);
    described_ = whole_body_.described();
  }

  Result<Excitation> run() {
    if (const Status s = check_start(); !s) return std::unexpected(s.error());
    std::optional<Candidate> best;
    for (int i = 0; i < request_.tries; ++i) {
      const bool fresh = i < (request_.tries + 1) / 2 || !best;
      Candidate next = fresh ? random_candidate() : changed(*best);
      if (!fit(next)) continue;
      next.condition = condition_of(next);
      if (!best || next.condition < best->condition) best = std::move(next);
    }
    if (!best) {
      return fail(
          "no candidate keeps every limit: the legs cannot keep the feet in place, or the "
          "robot loses its balance",
          "give --share less, or another --posture");
    }
    return answer(std::move(*best));
  }

 private:
  [[nodiscard]] std::vector<double> spread(const VectorXd& q) const {
    std::vector<double> position;
    for (const model::Joint& joint : tree_.joints) {
      const std::string& name =
          joint.follows() ? tree_.joints[static_cast<std::size_t>(joint.leader)].name : joint.name;
      const auto& names = identified_.regressor.coordinates();
      position.push_back(q[std::ranges::find(names, name) - names.begin()]);
    }
    return position;
  }
  [[nodiscard]] bool stands() const { return feet_.has_value() && !request_.hung; }
  [[nodiscard]] const hal::JointConfig& joint(Index coordinate) const {
    return robot_.joints[static_cast<std::size_t>(
        identified_.facts.joint[static_cast<std::size_t>(coordinate)])];
  }
  double uniform() { return static_cast<double>(split_mix(seed_) >> 11) * 0x1.0p-52 - 1.0; }

  /// How far a coordinate may go from the start, down and up.
  [[nodiscard]] std::pair<double, double> reach(Index c) const {
    const hal::JointConfig& config = joint(c);
    const bool endless = config.max_position_rad - config.min_position_rad > 20.0;
    const double down = endless ? kFreeTurn_rad : start_[c] - config.min_position_rad;
    const double up = endless ? kFreeTurn_rad : config.max_position_rad - start_[c];
    return {kPositionShare * std::max(0.0, down), kPositionShare * std::max(0.0, up)};
  }

  Candidate random_candidate() {
    Candidate candidate;
    VectorXd from(static_cast<Index>(free_.size()));
    for (Index i = 0; i < from.size(); ++i) from[i] = start_[free_[static_cast<std::size_t>(i)]];
    candidate.free = random_series(from, request_.harmonics, request_.period_s, seed_);
    if (stands())
      candidate.base =
          random_series(VectorXd::Zero(6), request_.harmonics, request_.period_s, seed_);
    return candidate;
  }

  Candidate changed(const Candidate& best) {
    Candidate next;
    next.free = best.free;
    next.base = best.base;
    for (ExcitingSeries* series : {&next.free, &next.base}) {
      for (MatrixXd* coefficients : {&series->a, &series->b}) {
        const double size = coefficients->size() > 0 ? coefficients->cwiseAbs().mean() : 0.0;
        for (double& one : coefficients->reshaped()) one += 0.5 * size * uniform();
      }
      if (series->a.size() > 0) series->rest_at_the_ends();
    }
    return next;
  }

  /// Makes each coordinate, and the base, as large as positions and speeds allow.
  void scale(Candidate& candidate) {
    const double speed = feet_ ? kSwayingShare * request_.share : request_.share;
    for (Index i = 0; i < candidate.free.start.size(); ++i) {
      const auto [down, up] = reach(free_[static_cast<std::size_t>(i)]);
      scale_column(candidate.free, i, down, up,
                   speed * joint(free_[static_cast<std::size_t>(i)]).max_velocity_rad_s);
    }
    for (Index i = 0; stands() && i < 6; ++i) {
      const double most = base_reach()[i];
      scale_column(candidate.base, i, most, i == 2 ? 0.3 * most : most,
                   std::numeric_limits<double>::infinity());
    }
  }
  static void scale_column(ExcitingSeries& series, Index column, double down, double up,
                           double speed) {
    double low = 0.0, high = 0.0, fastest = 0.0;
    for (int k = 0; k < kSamples; ++k) {
      const ExcitingSeries::State now = series.at(series.period_s * k / kSamples);
      const double way = now.x[column] - series.start[column];
      low = std::min(low, way);
      high = std::max(high, way);
      fastest = std::max(fastest, std::abs(now.v[column]));
    }
    double factor = std::numeric_limits<double>::infinity();
    if (low < 0.0) factor = std::min(factor, down / -low);
    if (high > 0.0) factor = std::min(factor, up / high);
    if (fastest > 0.0) factor = std::min(factor, speed / fastest);
    if (!std::isfinite(factor)) factor = 0.0;
    series.a.col(column) *= factor;
    series.b.col(column) *= factor;
  }

  /// The series of all coordinates. @return false: the legs cannot follow
  bool make_whole(Candidate& candidate) const {
    const int harmonics = stands() ? kLegHarmonics * request_.harmonics : request_.harmonics;
    candidate.whole = {request_.period_s, start_, MatrixXd::Zero(harmonics, start_.size()),
                       MatrixXd::Zero(harmonics, start_.size())};
    for (std::size_t i = 0; i < free_.size(); ++i) {
      candidate.whole.a.col(free_[i]).head(request_.harmonics) =
          candidate.free.a.col(static_cast<Index>(i));
      candidate.whole.b.col(free_[i]).head(request_.harmonics) =
          candidate.free.b.col(static_cast<Index>(i));
    }
    if (!stands()) return true;
    const auto& legs = feet_->leg_coordinates();
    MatrixXd positions(kSamples, static_cast<Index>(legs.size()));
    VectorXd q = start_;
    for (int k = 0; k < kSamples; ++k) {
      const BasePose pose = candidate.base.at(request_.period_s * k / kSamples).x;
      if (!feet_->solve_legs(pose, q)) return false;
      for (std::size_t i = 0; i < legs.size(); ++i)
        positions(k, static_cast<Index>(i)) = q[legs[i]];
    }
    const ExcitingSeries follow = series_through(positions, harmonics, request_.period_s);
    for (std::size_t i = 0; i < legs.size(); ++i) {
      candidate.whole.a.col(legs[i]) = follow.a.col(static_cast<Index>(i));
      candidate.whole.b.col(legs[i]) = follow.b.col(static_cast<Index>(i));
    }
    return true;
  }

  [[nodiscard]] Moment at(const Candidate& candidate, double t_s) const {
    Moment out;
    const ExcitingSeries::State now = candidate.whole.at(t_s);
    out.instant.q = now.x;
    out.instant.v = now.v;
    out.instant.vdot = now.acceleration;
    out.instant.w.setZero();
    out.instant.al.setZero();
    out.instant.a = -identified_.facts.gravity_m_s2;
    out.instant.wrenches.assign(identified_.regressor.sensor_count(),
                                Eigen::Matrix<double, 6, 1>::Zero());
    if (!stands()) return out;
    const ExcitingSeries::State base = candidate.base.at(t_s);
    out.pose = base.x;
    const auto turned = [&](double t) {
      return StandingMotion::placement(candidate.base.at(t).x).R;
    };
    const Eigen::Matrix3d before = turned(t_s - kStep_s), here = turned(t_s),
                          after = turned(t_s + kStep_s);
    const auto vee = [](const Eigen::Matrix3d& S) {
      return Vector3d(0.5 * (S(2, 1) - S(1, 2)), 0.5 * (S(0, 2) - S(2, 0)),
                      0.5 * (S(1, 0) - S(0, 1)));
    };
    out.instant.w = vee(here.transpose() * (after - before)) / (2.0 * kStep_s);
    const Vector3d late = vee(here.transpose() * after), early = vee(before.transpose() * here);
    out.instant.al = (late - early) / (kStep_s * kStep_s);
    out.instant.a =
        here.transpose() * (base.acceleration.head<3>() - identified_.facts.gravity_m_s2);
    return out;
  }

  /// Keeps the limits by making everything smaller. @return false: it is no use
  bool fit(Candidate& candidate) {
    scale(candidate);
    for (int attempt = 0; attempt < 14; ++attempt) {
      if (make_whole(candidate) && keeps_limits(candidate)) return true;
      for (ExcitingSeries* series : {&candidate.free, &candidate.base}) {
        series->a *= 0.85;
        series->b *= 0.85;
      }
    }
    return false;
  }

  bool keeps_limits(Candidate& candidate) {
    Excitation& out = candidate.figures;
    out = {};
    out.room_m = out.margin_m = std::numeric_limits<double>::infinity();
    MatrixXd Y;
    VectorXd known;
    for (int k = 0; k < kSamples; ++k) {
      const Moment now = at(candidate, request_.period_s * k / kSamples);
      out.room_m = std::min(out.room_m, distance_.room(spread(now.instant.q)));
      whole_body_.evaluate(now.instant, Y, known);
      VectorXd torque = Y * described_ + known;
      if (feet_) out.lowest_m = std::min(out.lowest_m, feet_->lowest(now.instant.q));
      if (stands()) {
        const StandingMotion::Load load = feet_->load(now.pose, now.instant.q, torque.head<6>());
        out.margin_m = std::min(out.margin_m, load.margin_m);
        if (load.slip > kSlip || load.least_share < kLeastShare) return false;
        torque.tail(start_.size()) += load.foot_torque;
      }
      if (!add_shares(now.instant, torque.tail(start_.size()), out)) return false;
    }
    if (out.room_m < 0.0) return false;
    if (!stands()) out.margin_m = 0.0;
    return !stands() || out.margin_m > kBalance_m;
  }

  bool add_shares(const Instant& now, const VectorXd& torque, Excitation& out) const {
    for (Index c = 0; c < start_.size(); ++c) {
      const hal::JointConfig& config = joint(c);
      const auto k = static_cast<std::size_t>(c);
      const double way = now.q[c] - start_[c];
      const auto [down, up] = reach(c);
      const double room = (way > 0.0 ? up : down) / kPositionShare;
      if (std::abs(way) > 1e-9)
        out.position_share = std::max(out.position_share, std::abs(way) / std::max(room, 1e-9));
      out.speed_share = std::max(out.speed_share, std::abs(now.v[c]) / config.max_velocity_rad_s);
      const double rotor = identified_.facts.rigid[k] ? identified_.facts.rotor_kg_m2[k] : 0.0;
      out.torque_share = std::max(out.torque_share,
                                  std::abs(torque[c] + rotor * now.vdot[c]) / config.max_torque_Nm);
    }
    constexpr double kRounding = 1.0 + 1e-9;
    return out.position_share < 0.97 && out.speed_share <= request_.share * kRounding &&
           out.torque_share <= request_.share;
  }

  double condition_of(const Candidate& candidate) {
    const Index columns = identified_.regressor.columns() + kJointColumns * start_.size();
    const auto count = base_.count();
    MatrixXd gram = MatrixXd::Zero(count, count);
    MatrixXd Y;
    VectorXd known;
    for (int k = 0; k < kMeasured; ++k) {
      const Moment now = at(candidate, request_.period_s * k / kMeasured);
      identified_.regressor.evaluate(now.instant, Y, known);
      MatrixXd rows(Y.rows(), count);
      for (Index r = 0; r < Y.rows(); ++r) {
        const Channel& channel = identified_.regressor.channels()[static_cast<std::size_t>(r)];
        if (request_.hung && channel.kind == Channel::Kind::kBase) {
          rows.row(r).setZero();
          continue;
        }
        VectorXd x = VectorXd::Zero(columns);
        x.head(Y.cols()) = Y.row(r);
        double scale = 1.0;
        if (channel.kind == Channel::Kind::kJoint) {
          const Index first = Y.cols() + kJointColumns * channel.index;
          const double v = now.instant.v[channel.index];
          x[first] = v;
          x[first + 1] = std::tanh(v / kStick_rad_s);
          x[first + 2] = 1.0;
          x[first + 3] = now.instant.vdot[channel.index];
          scale = 10.0 / joint(channel.index).max_torque_Nm;
        }
        for (Index i = 0; i < count; ++i)
          rows(r, i) = scale * x[base_.independent[static_cast<std::size_t>(i)]];
      }
      gram.selfadjointView<Eigen::Lower>().rankUpdate(rows.transpose());
    }
    gram = MatrixXd(gram.selfadjointView<Eigen::Lower>());
    // Columns of what moves: a joint that stands still has no friction to find.
    std::vector<Index> moving;
    for (Index i = 0; i < count; ++i)
      if (gram(i, i) > 1e-12) moving.push_back(i);
    MatrixXd part(static_cast<Index>(moving.size()), static_cast<Index>(moving.size()));
    for (std::size_t i = 0; i < moving.size(); ++i)
      for (std::size_t k = 0; k < moving.size(); ++k)
        part(static_cast<Index>(i), static_cast<Index>(k)) = gram(moving[i], moving[k]);
    return condition_number(part);
  }

  Status check_start() {
    Candidate rest = random_candidate();
    for (ExcitingSeries* series : {&rest.free, &rest.base}) {
      series->a.setZero();
      series->b.setZero();
    }
    if (make_whole(rest) && keeps_limits(rest)) return {};
    const Excitation& f = rest.figures;
    std::string why = "it does not keep its feet in place";
    if (f.torque_share > request_.share)
      why =
          fmt::format("standing still takes {:.0f} % of a joint's torque", 100.0 * f.torque_share);
    else if (f.room_m < 0.0)
      why = "links are too near to each other";
    else if (stands() && f.margin_m <= kBalance_m)
      why = fmt::format("its balance is {:.1f} cm from the edge of the feet", 100.0 * f.margin_m);
    return fail("the start posture cannot be moved from: " + why,
                "choose another --posture, or a larger --share");
  }

  Excitation answer(Candidate best) const {
    Excitation out = std::move(best.figures);
    out.condition_number = best.condition;
    out.base_parameters = static_cast<std::size_t>(base_.count());
    if (request_.hung) out.lift_m = kFreeFeet_m - std::min(0.0, out.lowest_m);
    std::vector<Index> moving;
    for (std::size_t j = 0; j < robot_.joints.size(); ++j) {
      const auto found = std::ranges::find(identified_.facts.joint, static_cast<int>(j));
      const Index c = found - identified_.facts.joint.begin();
      const bool moves = found != identified_.facts.joint.end() &&
                         (best.whole.a.col(c).norm() + best.whole.b.col(c).norm()) > 1e-6;
      (moves ? out.joints : out.still).push_back(robot_.joints[j].name);
      if (moves) moving.push_back(c);
      if (moves && stands() && std::ranges::count(feet_->leg_coordinates(), c) > 0)
        out.legs.push_back(robot_.joints[j].name);
    }
    out.series = {request_.period_s, VectorXd(static_cast<Index>(moving.size())),
                  MatrixXd(best.whole.a.rows(), static_cast<Index>(moving.size())),
                  MatrixXd(best.whole.a.rows(), static_cast<Index>(moving.size()))};
    for (std::size_t i = 0; i < moving.size(); ++i) {
      const auto to = static_cast<Index>(i);
      out.series.start[to] = start_[moving[i]];
      out.series.a.col(to) = best.whole.a.col(moving[i]);
      out.series.b.col(to) = best.whole.b.col(moving[i]);
    }
    return out;
  }

  const hal::RobotConfig& robot_;
  const model::Tree& tree_;
  IdentifiedRobot& identified_;
  Regressor whole_body_;  // without sensors: all that the ground carries
  const ExciteRequest& request_;
  VectorXd start_, described_;
  SelfDistance distance_;
  BaseParameters base_;
  std::uint64_t seed_;
  std::optional<StandingMotion> feet_;  // of a floating base
  std::vector<Index> free_;
};

}  // namespace

Result<Excitation> excite(const hal::RobotConfig& robot, const model::Tree& tree,
                          const ExciteRequest& request) {
  auto identified = make_identified_robot(tree, robot);
  if (!identified) return std::unexpected(identified.error());
  if (request.hung && !tree.floating_base)
    return fail("a robot with a fixed base cannot hang", "leave out --hung");
  auto whole_body = Regressor::create(tree, {});
  if (!whole_body) return std::unexpected(whole_body.error());
  const auto& names = identified->regressor.coordinates();
  std::vector<std::string> known;
  for (const hal::PostureConfig& posture : robot.postures) known.push_back(posture.name);
  const hal::PostureConfig* posture = robot.posture(request.posture);
  if (!request.posture.empty() && posture == nullptr) {
    return fail("the robot has no posture '" + request.posture + "'",
                suggest(request.posture, known));
  }
  VectorXd start = VectorXd::Zero(static_cast<Index>(names.size()));
  for (std::size_t c = 0; posture != nullptr && c < names.size(); ++c)
    start[static_cast<Index>(c)] =
        posture->position_rad[static_cast<std::size_t>(identified->facts.joint[c])];
  for (const std::string& name : request.joints) {
    if (std::ranges::find(names, name) != names.end()) continue;
    if (robot.follower(name) != nullptr) return std::unexpected(robot.no_joint(name));
    return fail("the robot has no joint '" + name + "'", suggest(name, names));
  }
  std::vector<Index> free;
  for (std::size_t c = 0; c < names.size(); ++c) {
    if (request.joints.empty() ||
        std::ranges::find(request.joints, names[c]) != request.joints.end())
      free.push_back(static_cast<Index>(c));
  }
  return Search(robot, tree, *identified, std::move(*whole_body), request, std::move(start),
                std::move(free))
      .run();
}

}  // namespace tandem::identification
