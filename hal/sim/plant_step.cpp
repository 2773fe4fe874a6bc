// How the plant advances: forces, accelerations and the two integrators.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "base/wide.hpp"
#include "hal/sim/plant.hpp"
#include "hal/sim/rotation.hpp"

namespace tandem::sim {

/// Everything at x that does not need the forces.
void Plant::touch_ground(const double* x, bool move_anchors) noexcept {
  sines_.take(x);
  bodies_.evaluate(x, x + kernels_->nq, move_anchors);
  if (contact_.feet() == 0) return;
  kernels_->site_twists_at(sines(), x, x + kernels_->nq, pose_.data(), twist_.data());
  if (engine_) return contact_.take(pose_.data(), point_forces_W_.data(), wrench_.data());
  contact_.evaluate(pose_.data(), twist_.data(), move_anchors, wrench_.data());
}

void Plant::rates(const double* x, MotorState motor_rate) noexcept {
  const double* q = x;
  const double* v = x + kernels_->nq;
  actuators_.evaluate(q + base_q_, v + base_v_, motor(x), tau_.data() + base_v_, motor_rate);
  for (std::size_t i = 0; i < kernels_->joints; ++i) {
    tau_[base_v_ + i] -= damping_[i] * v[base_v_ + i];
  }
  if (base_v_ != 0) {
    std::fill_n(tau_.begin(), 6, 0.0);
    hoist_.add_wrench(q, v, tau_.data());
  }
  // The same state with the same torques (elastic joints between two cycles): nothing to do.
  const std::vector<double>& forces = with_ends_and_ground(q, v);
  const std::size_t bytes = forces.size() * sizeof(double);
  if (vdot_fresh_ != 0 && std::memcmp(forces.data(), applied_tau_.data(), bytes) == 0) return;
  accelerate(q, v, forces.data());
  applied_tau_ = forces;
}

/// tau_ itself, to the bit, while no joint is at an end, only soles touch the ground and nobody
/// pushes.
const std::vector<double>& Plant::with_ends_and_ground(const double* q, const double* v) noexcept {
  const bool ends = stops_.touched(q + base_q_);
  if (!ends && !bodies_.touching() && !pushes_.any()) return tau_;
  forces_ = tau_;
  if (ends) stops_.add_torques(q + base_q_, v + base_v_, forces_.data() + base_v_);
  if (bodies_.touching()) bodies_.add_forces(forces_.data());
  if (pushes_.any()) pushes_.add_forces(q, v, forces_.data());
  return forces_;
}

// The loops' forces stand in the wrenches for the sensors; without them here, the tree is open.
void Plant::accelerate(const double* q, const double* v, const double* forces) noexcept {
  if (engine_) return;  // as its last step left them
  if (loops_.none()) {
    return kernels_->forward_dynamics_at(sines(), q, v, forces, wrench_.data(), vdot_.data());
  }
  loops_.let_go(wrench_.data());
  kernels_->forward_dynamics_at(sines(), q, v, forces, wrench_.data(), vdot_.data());
  loops_.constrain(q, v, vdot_.data(), wrench_.data());
}

void Plant::evaluate() noexcept TANDEM_RT {
  if (contact_fresh_ == 0) touch_ground(x_.data(), true);
  contact_fresh_ = 1;
  const std::size_t n = kernels_->joints;
  double* rate = motor_rate_.data();
  rates(x_.data(), {rate, rate + n, rate + 2 * n});
  vdot_fresh_ = 1;
}

Code Plant::advance(std::int64_t duration_ns) noexcept TANDEM_RT {
  while (duration_ns > 0) {
    if (diverged_ >= 0) return Code::kDiverged;
    evaluate();
    if (light_.due(time_ns_)) {
      light_.look(*kernels_, sines(), q(), v(), applied_tau_.data(), wrench_.data(), time_ns_);
    }
    const std::int64_t step_ns = std::min(duration_ns, light_.step_ns(substep_ns_));
    const double h_s = static_cast<double>(step_ns) * 1e-9;
    if (engine_) {
      step_engine(h_s);
    } else if (integrator_ == Integrator::kRungeKutta4) {
      step_runge_kutta(h_s);
    } else {
      step_semi_implicit(h_s);
    }
    if (!loops_.none()) loops_.project(x_.data(), x_.data() + kernels_->nq);
    bodies_.moved(v(), h_s);
    contact_fresh_ = vdot_fresh_ = 0;
    actuators_.finish_step(h_s, q() + base_q_, v() + base_v_, motor(x_.data()));
    actuators_.advance_brakes(step_ns, motor(x_.data()).position_rad);
    hoist_.advance(step_ns);
    time_ns_ += step_ns;
    duration_ns -= step_ns;
    if (!plausible()) return Code::kDiverged;
  }
  return Code::kOk;
}

void Plant::step_semi_implicit(double h_s) noexcept {
  double* q = x_.data();
  double* v = q + kernels_->nq;
  if (base_q_ != 0) step_base(h_s, q, v);
  for (std::size_t i = base_v_; i < kernels_->nv; ++i) {
    v[i] += h_s * vdot_[i];
    q[base_q_ - base_v_ + i] += h_s * v[i];
  }
  step_motors(h_s);
}

/// Velocities along B's axes change by B's turning too. A step of these would lengthen them by
/// (w h)^2 / 2, so the base's velocity is stepped along W's, where that of a free body stays.
void Plant::step_base(double h_s, double* q, double* v) noexcept {
  const Vec3 turning = cross({v[3], v[4], v[5]}, {v[0], v[1], v[2]});
  for (std::size_t i = 0; i < 3; ++i) v[i] += h_s * (vdot_[i] + turning[i]);
  const Vec3 velocity_W = rotate(rotation_of(q + 3).data(), v);
  for (std::size_t i = 0; i < 3; ++i) {
    q[i] += h_s * velocity_W[i];
    v[3 + i] += h_s * vdot_[3 + i];
  }
  turn_quaternion(q + 3, v + 3, h_s);
  const Vec3 velocity_B = rotate_back(rotation_of(q + 3).data(), velocity_W.data());
  std::ranges::copy(velocity_B, v);
}

void Plant::step_motors(double h_s) noexcept {
  const std::size_t n = kernels_->joints;
  const double* rate = motor_rate_.data();
  actuators_.step_semi_implicit(h_s, {rate, rate + n, rate + 2 * n}, motor(x_.data()));
}

void Plant::step_engine(double h_s) noexcept {
  double* q = x_.data();
  double* v = q + kernels_->nq;
  std::copy_n(v, kernels_->nv, vdot_.begin());
  try {
    engine_->step(h_s, applied_tau_.data(), q, v, point_forces_W_.data());
  } catch (...) {  // whatever its library throws: a state that is not plausible ends the run
    std::fill_n(v, kernels_->nv, std::numeric_limits<double>::quiet_NaN());
  }
  for (std::size_t i = 0; i < kernels_->nv; ++i) vdot_[i] = (v[i] - vdot_[i]) / h_s;
  step_motors(h_s);
}

/// The whole state's rate of change at `x`, forces given. A quaternion off unit length turns as
/// its normalised self would, which keeps its length and the integrator's order.
void Plant::state_rate(const double* x, double* rate) noexcept {
  rates(x, motor(rate));
  const double* v = x + kernels_->nq;
  if (base_q_ != 0) {
    const Mat3 R = rotation_of(x + 3);
    const Vec3 velocity_W = rotate(R.data(), v);
    std::copy(velocity_W.begin(), velocity_W.end(), rate);
    const double half_w[4] = {0.5 * v[3], 0.5 * v[4], 0.5 * v[5], 0.0};
    const std::array<double, 4> turn = quaternion_product(x + 3, half_w);
    std::copy(turn.begin(), turn.end(), rate + 3);
  }
  std::copy_n(v + base_v_, kernels_->joints, rate + base_q_);
  std::copy(vdot_.begin(), vdot_.end(), rate + kernels_->nq);
}

void Plant::step_runge_kutta(double h_s) noexcept {
  const std::size_t size = x_.size();
  const auto stage = [&](const std::vector<double>& k, double h, std::vector<double>& rate) {
    for (std::size_t i = 0; i < size; ++i) stage_[i] = x_[i] + h * k[i];
    if (base_q_ != 0) normalise_quaternion(stage_.data() + 3);
    loops_.changed();
    touch_ground(stage_.data(), false);
    state_rate(stage_.data(), rate.data());
  };
  state_rate(x_.data(), k1_.data());  // forces of evaluate() still stand
  vdot_fresh_ = 0;
  stage(k1_, 0.5 * h_s, k2_);
  stage(k2_, 0.5 * h_s, k3_);
  stage(k3_, h_s, k4_);
  for (std::size_t i = 0; i < size; ++i) {
    x_[i] += h_s / 6.0 * (k1_[i] + 2.0 * k2_[i] + 2.0 * k3_[i] + k4_[i]);
  }
  if (base_q_ != 0) normalise_quaternion(x_.data() + 3);
}

/// Whether every |v[i]| is within `limit`: not with NaN.
TANDEM_WIDE static bool all_within(double limit, const double* v, std::size_t n) noexcept {
  std::int64_t beyond = 0;  // as wide as what is compared
  for (std::size_t i = 0; i < n; ++i) beyond |= std::abs(v[i]) <= limit ? 0 : 1;
  return beyond == 0;
}

bool Plant::plausible() noexcept {
  const double* v = x_.data() + kernels_->nq;
  if (all_within(rate_limit_, v, kernels_->nv)) return true;
  for (std::size_t i = 0; i < kernels_->nv; ++i) {
    if (std::abs(v[i]) <= rate_limit_) continue;
    diverged_ = static_cast<std::int32_t>(i);
    diverged_rate_ = v[i];
    return false;
  }
  return true;
}

}  // namespace tandem::sim
