// How the plant advances: forces, accelerations and the two integrators.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "base/wide.hpp"
#include "hal/sim/plant.hpp"

namespace tandem::sim {

/// Everything at x, which is `ahead_s` from now, that does not need the forces.
void Plant::touch_ground(const PlantState& x, const double* v, bool move_anchors,
                         double ahead_s) noexcept {
  sines_.take(x.q());
  if (contact_.terrain().moves()) {
    const double time_s = static_cast<double>(time_ns_) * 1e-9 + ahead_s;
    const hal::GroundMotion moved = contact_.terrain().motion_at(time_s);
    contact_.move_ground(moved);
    bodies_.move_ground(moved);
  }
  bodies_.evaluate(x.q(), v, move_anchors);
  if (contact_.feet() == 0) return;
  kernels_->site_twists_at(sines(), x.q(), v, pose_.data(), twist_.data());
  if (engine_) return contact_.take(pose_.data(), point_forces_W_.data(), wrench_.data());
  contact_.evaluate(pose_.data(), twist_.data(), move_anchors, wrench_.data());
}

/// Forces at x, vdot_ and the motors' part of rate_.
void Plant::rates(const PlantState& x, const Velocities& v) noexcept {
  double* joint_tau = tau_.data() + base_v_;
  actuators_.evaluate(x.joint_q(), v.joint_dampers, x.motor(), v.motor_dampers, joint_tau,
                      rate_.motor());
  for (std::size_t i = 0; i < kernels_->joints; ++i)
    joint_tau[i] -= damping_[i] * v.joint_dampers[i];
  if (base_v_ != 0) {
    std::fill_n(tau_.begin(), 6, 0.0);
    hoist_.add_wrench(x.q(), v.forces, tau_.data());
  }
  // The same state with the same torques (elastic joints between two cycles): nothing to do.
  const std::vector<double>& forces = with_ends_and_ground(x, v.forces);
  const std::size_t bytes = forces.size() * sizeof(double);
  if (vdot_fresh_ != 0 && std::memcmp(forces.data(), applied_tau_.data(), bytes) == 0) return;
  accelerate(x.q(), v.dynamics, forces.data());
  applied_tau_ = forces;
}

/// tau_ itself, to the bit, while no joint is at an end, only soles touch the ground and nobody
/// pushes.
const std::vector<double>& Plant::with_ends_and_ground(const PlantState& x,
                                                       const double* v) noexcept {
  const bool ends = stops_.touched(x.joint_q());
  if (!ends && !bodies_.touching() && !pushes_.any()) return tau_;
  forces_ = tau_;
  if (ends) stops_.add_torques(x.joint_q(), v + base_v_, forces_.data() + base_v_);
  if (bodies_.touching()) bodies_.add_forces(forces_.data());
  if (pushes_.any()) pushes_.add_forces(x.q(), v, forces_.data());
  return forces_;
}

// The loops' forces stand in the wrenches for the sensors; without them here, the tree is open.
void Plant::accelerate(const double* q, const double* v, const double* forces) noexcept {
  if (engine_) return;  // as its last step left them
  if (loops_.none()) {
    return added_.forward_dynamics(sines(), q, v, forces, wrench_.data(), vdot_.data());
  }
  loops_.let_go(wrench_.data());
  added_.forward_dynamics(sines(), q, v, forces, wrench_.data(), vdot_.data());
  loops_.constrain(added_, q, v, vdot_.data(), wrench_.data());
}

void Plant::evaluate() noexcept TANDEM_RT {
  const Velocities v = leaps_ ? leap_velocities() : velocities_of(x_);
  if (contact_fresh_ == 0) touch_ground(x_, v.forces, true);
  contact_fresh_ = 1;
  rates(x_, v);
  vdot_fresh_ = 1;
}

/// For the sub-step of `step_ns` from now on.
void Plant::evaluate(std::int64_t step_ns) noexcept {
  if (pushes_.any()) pushes_.act_on(time_ns_, step_ns);
  evaluate();
}

Code Plant::advance(std::int64_t duration_ns) noexcept TANDEM_RT {
  while (duration_ns > 0) {
    if (diverged_ >= 0) return Code::kDiverged;
    std::int64_t step_ns = std::min(duration_ns, light_.step_ns(substep_ns_));
    evaluate(step_ns);
    if (light_.due(time_ns_)) {
      light_.look(added_, sines(), q(), v(), applied_tau_.data(), wrench_.data(), time_ns_);
      step_ns = std::min(duration_ns, light_.step_ns(substep_ns_));
      evaluate(step_ns);
    }
    const double h_s = static_cast<double>(step_ns) * 1e-9;
    if (engine_) {
      step_engine(h_s);
    } else if (integrator_ == Integrator::kRungeKutta4) {
      step_runge_kutta(h_s);
    } else {
      leap(h_s);
    }
    if (!loops_.none()) loops_.close_positions(x_.q(), x_.v());
    bodies_.moved(v(), h_s);
    contact_fresh_ = vdot_fresh_ = 0;
    if (!leaps_) settle(h_s);
    actuators_.advance_brakes(step_ns, x_.motor().position_rad);
    hoist_.advance(step_ns);
    time_ns_ += step_ns;
    duration_ns -= step_ns;
    if (leaps_) land(h_s);
    if (!plausible()) return Code::kDiverged;
  }
  return Code::kOk;
}

void Plant::step_engine(double h_s) noexcept {
  double* v = x_.v();
  std::copy_n(v, kernels_->nv, vdot_.begin());
  try {
    engine_->step(h_s, applied_tau_.data(), x_.q(), v, point_forces_W_.data());
  } catch (...) {  // whatever its library throws: a state that is not plausible ends the run
    std::fill_n(v, kernels_->nv, std::numeric_limits<double>::quiet_NaN());
  }
  for (std::size_t i = 0; i < kernels_->nv; ++i) vdot_[i] = (v[i] - vdot_[i]) / h_s;
  actuators_.kick(h_s, rate_.motor(), x_.motor());
  actuators_.drift(h_s, x_.joint_q(), x_.motor());
}

Plant::Velocities Plant::velocities_of(const PlantState& x) noexcept {
  return {.dynamics = x.v(),
          .forces = x.v(),
          .joint_dampers = x.joint_v(),
          .motor_dampers = x.motor().velocity_rad_s};
}

Plant::Velocities Plant::leap_velocities() const noexcept {
  return {.dynamics = ahead_v_.data(),
          .forces = midway_v_.data(),
          .joint_dampers = damper_v_.data(),
          .motor_dampers = damper_v_.data() + kernels_->joints};
}

/// The state is one of choice: no velocity is predicted, none is behind.
void Plant::begin_leaps() noexcept {
  std::copy_n(x_.v(), ahead_v_.size(), ahead_v_.begin());
  std::copy_n(x_.v(), midway_v_.size(), midway_v_.begin());
  std::copy_n(x_.joint_v(), kernels_->joints, damper_v_.begin());
  std::copy_n(x_.motor().velocity_rad_s, kernels_->joints,
              damper_v_.begin() + static_cast<std::ptrdiff_t>(kernels_->joints));
}

/// Half the kick, and the drift with the velocity that it gives.
/// @pre rate_ and vdot_ are those of evaluate()
void Plant::leap(double h_s) noexcept {
  x_.kick(0.5 * h_s, vdot_.data(), ahead_v_.data());
  actuators_.kick(0.5 * h_s, rate_.motor(), x_.motor());
  std::copy_n(x_.v(), kernels_->nv + 2 * kernels_->joints, stage_.v());
  stage_.kick(0.5 * h_s, vdot_.data(), ahead_v_.data());
  actuators_.kick(0.5 * h_s, rate_.motor(), stage_.motor());
  const std::size_t n = kernels_->joints;
  const double *joint = x_.joint_v(), *motor = x_.motor().velocity_rad_s;
  const double *joint_ahead = stage_.joint_v(), *motor_ahead = stage_.motor().velocity_rad_s;
  for (std::size_t j = 0; j < n; ++j) {
    damper_v_[j] = predicted_[j] != 0.0 ? joint_ahead[j] : joint[j];
    damper_v_[n + j] = predicted_[j] != 0.0 ? motor_ahead[j] : motor[j];
  }
  std::copy_n(stage_.v(), ahead_v_.size(), ahead_v_.begin());
  x_.drift(h_s, ahead_v_.data());
  actuators_.drift(h_s, x_.joint_q(), x_.motor());
}

/// The other half of the kick, by the forces where the drift has led.
void Plant::land(double h_s) noexcept {
  std::copy_n(x_.v(), midway_v_.size(), midway_v_.begin());
  evaluate();
  x_.kick(0.5 * h_s, vdot_.data(), ahead_v_.data());
  actuators_.kick(0.5 * h_s, rate_.motor(), x_.motor());
  if (flies()) {
    flight_.keep(h_s, added_, sines(), x_.q(), x_.v());
  } else {
    flight_.end();
  }
  settle(h_s);
}

/// Whether nothing but weight acts from outside.
bool Plant::flies() const noexcept {
  return !hoist_.holding() && !pushes_.any() && !bodies_.touching() && !contact_.touching();
}

/// What of a step is no motion: rates are those of closed loops, currents and windings follow.
void Plant::settle(double h_s) noexcept {
  if (!loops_.none()) loops_.close_velocities(added_, x_.q(), x_.v());
  actuators_.finish_step(h_s, x_.joint_q(), x_.joint_v(), x_.motor());
}

/// @pre rate_ and vdot_ are those of evaluate()
void Plant::step_runge_kutta(double h_s) noexcept {
  vdot_fresh_ = 0;
  rate_.follow(x_, vdot_.data());
  sum_ = rate_;
  constexpr double kStages[3][2] = {{0.5, 2.0}, {0.5, 2.0}, {1.0, 1.0}};  // how far in h, weight
  for (const auto& [ahead, weight] : kStages) {
    stage_.move(x_, ahead * h_s, rate_);
    loops_.changed();
    touch_ground(stage_, stage_.v(), false, ahead * h_s);
    rates(stage_, velocities_of(stage_));
    rate_.follow(stage_, vdot_.data());
    sum_.add(weight, rate_);
  }
  x_.move(x_, h_s / 6.0, sum_);
}

/// Whether every |v[i]| is within `limit`: not with NaN.
TANDEM_WIDE static bool all_within(double limit, const double* v, std::size_t n) noexcept {
  std::int64_t beyond = 0;  // as wide as what is compared
  for (std::size_t i = 0; i < n; ++i) beyond |= std::abs(v[i]) <= limit ? 0 : 1;
  return beyond == 0;
}

bool Plant::plausible() noexcept {
  const double* v = x_.v();
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
