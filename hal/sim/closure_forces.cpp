// M is factorised by Cholesky once per position; A M^-1 A^T by SemidefiniteSolver, since equations
// may be redundant.
#include "hal/sim/closure_forces.hpp"

#include <algorithm>
#include <cmath>

#include "hal/sim/cholesky.hpp"
#include "hal/sim/rotation.hpp"

namespace tandem::sim {
namespace {

constexpr double kClosed_m = 1e-12;
constexpr int kMostSteps = 4;  // of one projection; each divides the error by about 1000

}  // namespace

ClosureForces::ClosureForces(model::ClosedLoops loops, const tandem_kernels& kernels)
    : kernels_(&kernels), loops_(std::move(loops)), solver_(loops_.rows()) {
  const std::size_t rows = loops_.rows();
  M_.assign(std::size_t{kernels.nv} * kernels.nv, 0.0);
  W_.assign(rows * kernels.nv, 0.0);
  S_.assign(rows * rows, 0.0);
  lambda_.assign(rows, 0.0);
  change_.assign(rows, 0.0);
  step_.assign(kernels.nv, 0.0);
  for (auto* errors : {&position_error_m_, &velocity_error_m_s_, &worst_position_m_})
    errors->assign(loops_.loops(), 0.0);
}

// What depends on q alone: A, M = L L^T, the rows W of A L^-T, and S = A M^-1 A^T = W W^T.
void ClosureForces::prepare(AddedInertia& added, const double* q, const double* v) noexcept {
  loops_.move(q, v);
  if (fresh_) return;
  fresh_ = true;
  const std::size_t n = kernels_->nv;
  const std::size_t rows = loops_.rows();
  loops_.differentiate(q);
  kernels_->mass_matrix_at(loops_.sines(), q, M_.data());
  added.add_to_mass_matrix(q, M_.data());
  cholesky(M_, n);
  std::copy(loops_.jacobian().begin(), loops_.jacobian().end(), W_.begin());
  for (std::size_t r = 0; r < rows; ++r) {
    double* w = W_.data() + r * n;
    for (std::size_t i = 0; i < n; ++i) {
      for (std::size_t j = 0; j < i; ++j) w[i] -= M_[i * n + j] * w[j];
      w[i] /= M_[i * n + i];
    }
    for (std::size_t s = 0; s <= r; ++s) {
      double sum = 0.0;
      for (std::size_t i = 0; i < n; ++i) sum += w[i] * W_[s * n + i];
      S_[r * rows + s] = S_[s * rows + r] = sum;
    }
  }
  solver_.factorise(S_, rows);
}

// lambda_ = S^-1 change, step_ = M^-1 A^T lambda_: the change of A step_ with the least work.
void ClosureForces::impulse(const std::vector<double>& change) noexcept {
  const std::size_t n = kernels_->nv;
  lambda_ = change;
  solver_.solve(lambda_);
  std::fill(step_.begin(), step_.end(), 0.0);
  for (std::size_t r = 0; r < lambda_.size(); ++r)
    for (std::size_t i = 0; i < n; ++i) step_[i] += W_[r * n + i] * lambda_[r];
  for (std::size_t i = n; i-- > 0;) {
    for (std::size_t j = i + 1; j < n; ++j) step_[i] -= M_[j * n + i] * step_[j];
    step_[i] /= M_[i * n + i];
  }
}

void ClosureForces::constrain(AddedInertia& added, const double* q, const double* v, double* vdot,
                              double* wrench) noexcept TANDEM_RT {
  prepare(added, q, v);
  const std::size_t n = kernels_->nv;
  for (std::size_t r = 0; r < change_.size(); ++r) {
    change_[r] = -loops_.equations()[r].bias;
    for (std::size_t i = 0; i < n; ++i) change_[r] -= loops_.jacobian()[r * n + i] * vdot[i];
  }
  impulse(change_);
  for (std::size_t i = 0; i < n; ++i) vdot[i] += step_[i];
  loops_.to_wrenches(lambda_.data(), wrench);
}

void ClosureForces::step_positions(double* q) const noexcept {
  const std::size_t base = kernels_->floating_base != 0 ? 6 : 0;
  if (base != 0) {
    const Mat3 R = rotation_of(q + 3);
    const Vec3 linear_W = rotate(R.data(), step_.data());
    for (std::size_t i = 0; i < 3; ++i) q[i] += linear_W[i];
    turn_quaternion(q + 3, step_.data() + 3, 1.0);
  }
  for (std::size_t i = 0; i < kernels_->joints; ++i)
    q[kernels_->nq - kernels_->joints + i] += step_[base + i];
}

void ClosureForces::close_positions(double* q, const double* v) noexcept TANDEM_RT {
  for (int step = 0;; ++step) {
    loops_.move(q, v);
    double open = 0.0;
    for (std::size_t r = 0; r < change_.size(); ++r) {
      change_[r] = -loops_.equations()[r].error;
      open += std::abs(change_[r]);
    }
    if (open < kClosed_m || step == kMostSteps || !std::isfinite(open)) break;
    impulse(change_);
    step_positions(q);
  }
  for (std::size_t l = 0; l < loops_.loops(); ++l) {
    position_error_m_[l] = loops_.position_error_m(l);
    worst_position_m_[l] = std::max(worst_position_m_[l], position_error_m_[l]);
  }
  fresh_ = false;
}

void ClosureForces::close_velocities(AddedInertia& added, const double* q,
                                     double* v) noexcept TANDEM_RT {
  prepare(added, q, v);
  const std::size_t n = kernels_->nv;
  for (std::size_t r = 0; r < change_.size(); ++r) {
    change_[r] = 0.0;
    for (std::size_t i = 0; i < n; ++i) change_[r] -= loops_.jacobian()[r * n + i] * v[i];
  }
  impulse(change_);
  for (std::size_t i = 0; i < n; ++i) v[i] += step_[i];
  for (std::size_t l = 0; l < loops_.loops(); ++l)
    velocity_error_m_s_[l] = loops_.velocity_error_m_s(l, v);
}

}  // namespace tandem::sim
