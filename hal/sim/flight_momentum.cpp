// The base's rows of the mass matrix give the momentum at the base's origin, along its axes; their
// first six columns the mass and the center of mass as well.
#include "hal/sim/flight_momentum.hpp"

#include <algorithm>

#include "hal/sim/cholesky.hpp"
#include "hal/sim/rotation.hpp"

namespace tandem::sim {

FlightMomentum::FlightMomentum(const tandem_kernels& kernels) {
  if (kernels.floating_base == 0) return;
  M_.assign(std::size_t{kernels.nv} * kernels.nv, 0.0);
  block_.assign(36, 0.0);
}

void FlightMomentum::keep(double h_s, AddedInertia& added, const double* sines, const double* q,
                          double* v) noexcept TANDEM_RT {
  if (M_.empty()) return;
  const tandem_kernels& k = added.kernels();
  const std::size_t nv = k.nv;
  k.mass_matrix_at(sines, q, M_.data());
  added.add_to_mass_matrix(q, M_.data());
  std::array<double, 6> p{};
  for (std::size_t r = 0; r < 6; ++r) {
    std::copy_n(M_.data() + r * nv, 6, block_.data() + 6 * r);
    for (std::size_t i = 0; i < nv; ++i) p[r] += M_[r * nv + i] * v[i];
  }
  const double mass_kg = M_[0];  // the linear rows are [m 1, -m (c x)]
  const Vec3 center{M_[nv + 5] / mass_kg, M_[2 * nv + 3] / mass_kg, M_[4] / mass_kg};
  const Mat3 R = rotation_of(q + 3);
  const Vec3 linear{p[0], p[1], p[2]}, moved = cross(center, linear);
  const Vec3 about_center{p[3] - moved[0], p[4] - moved[1], p[5] - moved[2]};
  if (flying_ == 0) {
    flying_ = 1;
    std::ranges::copy(rotate(R.data(), linear.data()), momentum_W_.begin());
    std::ranges::copy(rotate(R.data(), about_center.data()), momentum_W_.begin() + 3);
    return;
  }
  for (std::size_t i = 0; i < 3; ++i) momentum_W_[i] += mass_kg * h_s * k.gravity_m_s2[i];
  const Vec3 linear_B = rotate_back(R.data(), momentum_W_.data());
  const Vec3 angular_B = rotate_back(R.data(), momentum_W_.data() + 3);
  const Vec3 arm = cross(center, linear_B);
  double change[6];
  for (std::size_t i = 0; i < 3; ++i) {
    change[i] = linear_B[i] - p[i];
    change[3 + i] = angular_B[i] + arm[i] - p[3 + i];
  }
  cholesky(block_, 6);
  solve_cholesky(block_, 6, change);
  for (std::size_t i = 0; i < 6; ++i) v[i] += change[i];
}

}  // namespace tandem::sim
