// Residuals c(q) and Jacobian rows A of ball, revolute and rod loops from the sites' poses; passive
// joints by Gauss-Newton on A_p^T A_p.
#include "model/closed_loops.hpp"

#include <fmt/core.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/nearest.hpp"

namespace tandem::model {
namespace {

using Eigen::Vector3d;
using Map3 = Eigen::Map<const Vector3d>;
using MapR = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>;

constexpr double kClosed_m = 1e-12;
constexpr double kLongestStep = 0.2;  // [rad or m] of one joint in one step of close()

std::vector<std::string> names(const char* const* first, std::uint32_t count) {
  return {first, first + count};
}

Result<std::size_t> find(const std::vector<std::string>& all, const std::string& name,
                         const std::string& what) {
  const auto found = std::ranges::find(all, name);
  if (found != all.end()) return static_cast<std::size_t>(found - all.begin());
  return std::unexpected(
      Error{.message = "the robot's kernels lack the " + what,
            .hint = "build them again from this robot.toml; " + suggest(name, all),
            .file = {},
            .key = name});
}

std::size_t equations_of(KinematicLoopType type) {
  return type == KinematicLoopType::kRod ? 1 : type == KinematicLoopType::kBall ? 3 : 5;
}

}  // namespace

std::string ClosureGap::to_string() const {
  constexpr double kSmall = 1e-9;
  const double degrees = axis_rad * 180.0 / std::numbers::pi;
  std::string axes = fmt::format("its axes are {:.4g} degrees apart", degrees);
  if (!(axis_rad > kSmall)) return fmt::format("a gap of {:.4g} m is left", position_m);
  if (!(position_m > kSmall)) return axes;
  return axes + fmt::format(", and a gap of {:.4g} m is left", position_m);
}

Result<ClosedLoops> ClosedLoops::create(const std::vector<KinematicLoop>& loops,
                                        const std::vector<std::string>& passive,
                                        const tandem_kernels& kernels) {
  ClosedLoops result;
  result.kernels_ = &kernels;
  result.sines_ = Sines(kernels);
  for (const KinematicLoop& loop : loops)
    if (Status status = result.add(loop); !status) return std::unexpected(status.error());
  const std::vector<std::string> joints = names(kernels.joint_names, kernels.joints);
  const std::size_t base = kernels.floating_base != 0 ? 6 : 0;
  for (const std::string& joint : passive) {
    const Result<std::size_t> index = find(joints, joint, "passive joint");
    if (!index) return std::unexpected(index.error());
    result.passive_.push_back(base + *index);
  }
  const std::size_t n = result.passive_.size();
  result.A_.assign(result.rows() * kernels.nv, 0.0);
  result.J_.assign(std::size_t{6} * kernels.nv * kernels.sites, 0.0);
  result.pose_.assign(std::size_t{12} * kernels.sites, 0.0);
  result.twist_.assign(std::size_t{6} * kernels.sites, 0.0);
  result.acceleration_.assign(std::size_t{6} * kernels.sites, 0.0);
  result.zero_.assign(kernels.nv, 0.0);
  result.N_.assign(n * n, 0.0);
  result.unknown_.assign(n, 0.0);
  result.lambda_.assign(result.rows(), 0.0);
  result.solver_ = SemidefiniteSolver(n);
  return result;
}

Status ClosedLoops::add(const KinematicLoop& spec) {
  Loop loop{.spec = spec, .axis = Vector3d(spec.axis.data()).normalized(), .across = {}};
  loop.across[0] = loop.axis.unitOrthogonal();
  loop.across[1] = loop.axis.cross(loop.across[0]);
  for (std::size_t i = 0; i < 2; ++i) {
    const std::string what = "site of loop '" + spec.name + "'";
    const Result<std::size_t> site =
        find(names(kernels_->site_names, kernels_->sites), spec.sites[i], what);
    if (!site) return std::unexpected(site.error());
    const Result<std::size_t> wrench = find(names(kernels_->wrench_names, kernels_->wrenches),
                                            spec.sites[i], "force at a " + what);
    if (!wrench) return std::unexpected(wrench.error());
    loop.site[i] = *site;
    loop.wrench[i] = *wrench;
  }
  rows_.resize(rows_.size() + equations_of(spec.type), ClosureEquation{.loop = loops_.size()});
  loops_.push_back(std::move(loop));
  return {};
}

void ClosedLoops::move(const double* q, const double* v) noexcept TANDEM_RT {
  if (loops_.empty()) return;
  sines_.take(q);
  kernels_->site_motion_at(sines(), q, v, zero_.data(), pose_.data(), twist_.data(),
                           acceleration_.data());
  ClosureEquation* row = rows_.data();
  for (const Loop& loop : loops_) {
    if (loop.spec.type == KinematicLoopType::kRod) {
      write_rod(loop, *row);
    } else {
      write_point(loop, row);
      if (loop.spec.type == KinematicLoopType::kRevolute) write_axis(loop, row + 3);
    }
    row += equations_of(loop.spec.type);
  }
}

// c = |d| - L with d = p1 - p2.
void ClosedLoops::write_rod(const Loop& loop, ClosureEquation& row) const noexcept {
  const auto [a, b] = loop.site;
  const Vector3d d = Map3(&pose_[12 * a + 9]) - Map3(&pose_[12 * b + 9]);
  const Vector3d rate = Map3(&twist_[6 * a]) - Map3(&twist_[6 * b]);
  const double length = d.norm();
  row.f = length > 0.0 ? Vector3d(d / length) : Vector3d(Vector3d::UnitX());
  row.error = length - loop.spec.length_m;
  const double along = row.f.dot(rate);
  row.bias = row.f.dot(Map3(&acceleration_[6 * a]) - Map3(&acceleration_[6 * b])) +
             (length > 0.0 ? (rate.squaredNorm() - along * along) / length : 0.0);
}

// c = p1 - p2, in W.
void ClosedLoops::write_point(const Loop& loop, ClosureEquation* rows) const noexcept {
  const auto [a, b] = loop.site;
  for (std::size_t i = 0; i < 3; ++i) {
    rows[i].f = Vector3d::Unit(static_cast<Eigen::Index>(i));
    rows[i].error = pose_[12 * a + 9 + i] - pose_[12 * b + 9 + i];
    rows[i].bias = acceleration_[6 * a + i] - acceleration_[6 * b + i];
  }
}

// c = t . z2 for two directions t of body 1 across the axis; c' = (t x z2) . (w1 - w2).
void ClosedLoops::write_axis(const Loop& loop, ClosureEquation* rows) const noexcept {
  const auto [a, b] = loop.site;
  const Vector3d z2 = MapR(&pose_[12 * b]) * loop.axis;
  const Vector3d w1 = Map3(&twist_[6 * a + 3]);
  const Vector3d w2 = Map3(&twist_[6 * b + 3]);
  const Vector3d angular = Map3(&acceleration_[6 * a + 3]) - Map3(&acceleration_[6 * b + 3]);
  const Vector3d z1 = MapR(&pose_[12 * a]) * loop.axis;
  // Turned the wrong way round, t . z2 is zero too: the error is then the whole way.
  const double reversed = z1.dot(z2) < 0.0 ? 2.0 * kAngleArm_m : 0.0;
  for (std::size_t i = 0; i < 2; ++i) {
    const Vector3d t = MapR(&pose_[12 * a]) * loop.across[i];
    const Vector3d turn = w1.cross(t).cross(z2) + t.cross(w2.cross(z2));
    rows[i].m = kAngleArm_m * t.cross(z2);
    rows[i].error = kAngleArm_m * t.dot(z2) + reversed;
    rows[i].bias = rows[i].m.dot(angular) + kAngleArm_m * turn.dot(w1 - w2);
  }
}

void ClosedLoops::differentiate(const double* q) noexcept TANDEM_RT {
  if (loops_.empty()) return;
  kernels_->site_jacobians_at(sines(), q, J_.data());
  const std::size_t nv = kernels_->nv;
  for (std::size_t r = 0; r < rows_.size(); ++r) {
    const ClosureEquation& row = rows_[r];
    const auto [a, b] = loops_[row.loop].site;
    for (std::size_t k = 0; k < nv; ++k) {
      double sum = 0.0;
      for (std::size_t i = 0; i < 3; ++i) {
        const auto part = static_cast<Eigen::Index>(i);
        sum += row.f[part] * (J_[(6 * a + i) * nv + k] - J_[(6 * b + i) * nv + k]) +
               row.m[part] * (J_[(6 * a + 3 + i) * nv + k] - J_[(6 * b + 3 + i) * nv + k]);
      }
      A_[r * nv + k] = sum;
    }
  }
}

double ClosedLoops::position_error_m(std::size_t loop) const noexcept TANDEM_RT {
  double sum = 0.0;
  for (const ClosureEquation& row : rows_)
    if (row.loop == loop) sum += row.error * row.error;
  return std::sqrt(sum);
}

ClosureGap ClosedLoops::gap(std::size_t loop) const noexcept TANDEM_RT {
  const Loop& one = loops_[loop];
  const auto [a, b] = one.site;
  const Vector3d d = Map3(&pose_[12 * a + 9]) - Map3(&pose_[12 * b + 9]);
  if (one.spec.type == KinematicLoopType::kRod)
    return {std::abs(d.norm() - one.spec.length_m), 0.0};
  if (one.spec.type == KinematicLoopType::kBall) return {d.norm(), 0.0};
  const Vector3d z1 = MapR(&pose_[12 * a]) * one.axis;
  const Vector3d z2 = MapR(&pose_[12 * b]) * one.axis;
  return {d.norm(), std::atan2(z1.cross(z2).norm(), z1.dot(z2))};
}

double ClosedLoops::velocity_error_m_s(std::size_t loop, const double* v) const noexcept TANDEM_RT {
  double sum = 0.0;
  for (std::size_t r = 0; r < rows_.size(); ++r) {
    if (rows_[r].loop != loop) continue;
    double rate = 0.0;
    for (std::size_t k = 0; k < kernels_->nv; ++k) rate += A_[r * kernels_->nv + k] * v[k];
    sum += rate * rate;
  }
  return std::sqrt(sum);
}

void ClosedLoops::clear_wrenches(double* wrench) const noexcept TANDEM_RT {
  for (const Loop& loop : loops_)
    for (const std::size_t at : loop.wrench) std::fill_n(wrench + 6 * at, 6, 0.0);
}

void ClosedLoops::to_wrenches(const double* lambda, double* wrench) const noexcept TANDEM_RT {
  clear_wrenches(wrench);
  for (std::size_t r = 0; r < rows_.size(); ++r) {
    const Loop& loop = loops_[rows_[r].loop];
    for (std::size_t side = 0; side < 2; ++side) {
      const MapR R(&pose_[12 * loop.site[side]]);
      const double share = side == 0 ? lambda[r] : -lambda[r];
      Eigen::Map<Vector3d> force(wrench + 6 * loop.wrench[side]);
      Eigen::Map<Vector3d> moment(wrench + 6 * loop.wrench[side] + 3);
      force += R.transpose() * rows_[r].f * share;
      moment += R.transpose() * rows_[r].m * share;
    }
  }
}

// N = A_p^T A_p of the passive joints' columns.
void ClosedLoops::factorise_passive() noexcept {
  const std::size_t n = passive_.size();
  const std::size_t nv = kernels_->nv;
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t j = 0; j <= i; ++j) {
      double sum = 0.0;
      for (std::size_t r = 0; r < rows_.size(); ++r)
        sum += A_[r * nv + passive_[i]] * A_[r * nv + passive_[j]];
      N_[i * n + j] = N_[j * n + i] = sum;
    }
  solver_.factorise(N_, n);
}

// Least squares: unknown = - (A_p^T A_p)^-1 A_p^T lambda_, with lambda_ the rows to be undone.
void ClosedLoops::step_passive(double* unknown) noexcept {
  const std::size_t n = passive_.size();
  for (std::size_t i = 0; i < n; ++i) {
    unknown[i] = 0.0;
    for (std::size_t r = 0; r < rows_.size(); ++r)
      unknown[i] -= A_[r * kernels_->nv + passive_[i]] * lambda_[r];
  }
  solver_.solve({unknown, n});
}

bool ClosedLoops::close(double* q, int most_steps) noexcept TANDEM_RT {
  const std::size_t to_q = kernels_->nq - kernels_->nv;
  for (int step = 0;; ++step) {
    move(q, zero_.data());
    differentiate(q);
    double open = 0.0;  // NaN stays NaN
    for (const ClosureEquation& row : rows_) open += std::abs(row.error);
    if (open < kClosed_m) return true;
    if (step == most_steps || !std::isfinite(open)) return false;
    for (std::size_t r = 0; r < rows_.size(); ++r) lambda_[r] = rows_[r].error;
    factorise_passive();
    step_passive(unknown_.data());
    double longest = kLongestStep;
    for (const double x : unknown_) longest = std::max(longest, std::abs(x));
    for (std::size_t i = 0; i < passive_.size(); ++i)
      q[to_q + passive_[i]] += unknown_[i] * kLongestStep / longest;
  }
}

void ClosedLoops::close_rates(double* v) noexcept TANDEM_RT {
  if (loops_.empty()) return;
  for (std::size_t r = 0; r < rows_.size(); ++r) {
    lambda_[r] = 0.0;
    for (std::size_t k = 0; k < kernels_->nv; ++k) lambda_[r] += A_[r * kernels_->nv + k] * v[k];
  }
  factorise_passive();
  step_passive(unknown_.data());
  for (std::size_t i = 0; i < passive_.size(); ++i) v[passive_[i]] += unknown_[i];
}

void ClosedLoops::carry_passive(double* tau) noexcept TANDEM_RT {
  if (loops_.empty()) return;
  const std::size_t nv = kernels_->nv;
  for (std::size_t i = 0; i < passive_.size(); ++i) unknown_[i] = tau[passive_[i]];
  factorise_passive();
  solver_.solve(unknown_);
  for (std::size_t r = 0; r < rows_.size(); ++r) {
    double lambda = 0.0;  // A_p^T lambda = tau_p
    for (std::size_t i = 0; i < passive_.size(); ++i)
      lambda += A_[r * nv + passive_[i]] * unknown_[i];
    for (std::size_t k = 0; k < nv; ++k) tau[k] -= A_[r * nv + k] * lambda;
  }
}

}  // namespace tandem::model
