// A floating base turns: its steps and rates, and then all that is alike for every number.
#include "hal/sim/plant_state.hpp"

#include <algorithm>

#include "hal/sim/rotation.hpp"

namespace tandem::sim {

void PlantState::place(std::span<const double> q, std::span<const double> v) noexcept TANDEM_RT {
  std::copy(q.begin(), q.end(), this->q());
  std::copy(v.begin(), v.end(), this->v());
  std::copy_n(joint_q(), joints_, motor().position_rad);
  std::copy_n(joint_v(), joints_, motor().velocity_rad_s);
  std::fill_n(motor().current_A, joints_, 0.0);
}

/// A base's velocity changes along B's axes by B's turning, too. That part is left out, as a step
/// of it would lengthen the velocity: drift() turns the axes.
void PlantState::kick(double h_s, const double* vdot, const double* at_v) noexcept TANDEM_RT {
  double* v = this->v();
  if (floating()) {
    const Vec3 turning = cross({at_v[3], at_v[4], at_v[5]}, {at_v[0], at_v[1], at_v[2]});
    for (std::size_t i = 0; i < 3; ++i) v[i] += h_s * turning[i];
  }
  for (std::size_t i = 0; i < nv_; ++i) v[i] += h_s * vdot[i];
}

void PlantState::drift(double h_s, double* ahead) noexcept TANDEM_RT {
  double* v = this->v();
  if (floating()) {
    double* q = this->q();
    const Mat3 before = rotation_of(q + 3);
    const Vec3 velocity_W = rotate(before.data(), v), ahead_W = rotate(before.data(), ahead);
    for (std::size_t i = 0; i < 3; ++i) q[i] += h_s * velocity_W[i];
    turn_quaternion(q + 3, v + 3, h_s);
    const Mat3 after = rotation_of(q + 3);
    std::ranges::copy(rotate_back(after.data(), velocity_W.data()), v);
    std::ranges::copy(rotate_back(after.data(), ahead_W.data()), ahead);
  }
  double* q = joint_q();
  v += nv_ - joints_;
  for (std::size_t i = 0; i < joints_; ++i) q[i] += h_s * v[i];
}

void PlantState::move(const PlantState& from, double h_s,
                      const PlantState& rate) noexcept TANDEM_RT {
  for (std::size_t i = 0; i < x_.size(); ++i) x_[i] = from.x_[i] + h_s * rate.x_[i];
  if (floating()) normalise_quaternion(q() + 3);
}

void PlantState::follow(const PlantState& x, const double* vdot) noexcept TANDEM_RT {
  if (floating()) {
    const double* v = x.v();
    std::ranges::copy(rotate(rotation_of(x.q() + 3).data(), v), q());
    const double half_w[4] = {0.5 * v[3], 0.5 * v[4], 0.5 * v[5], 0.0};
    std::ranges::copy(quaternion_product(x.q() + 3, half_w), q() + 3);
  }
  std::copy_n(x.joint_v(), joints_, joint_q());
  std::copy_n(vdot, nv_, v());
}

void PlantState::add(double weight, const PlantState& rate) noexcept TANDEM_RT {
  for (std::size_t i = 0; i < x_.size(); ++i) x_[i] += weight * rate.x_[i];
}

}  // namespace tandem::sim
