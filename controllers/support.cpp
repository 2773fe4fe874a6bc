#include "controllers/support.hpp"

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace tandem {

void carry_on_both_feet(const tandem_kernels& kernels, const Feet& feet, std::span<const double> q,
                        std::span<const double> pose, std::span<const double> J,
                        std::span<double> tau) noexcept TANDEM_RT {
  using Vector3 = Eigen::Vector3d;
  using Wrench = Eigen::Matrix<double, 6, 1>;
  const std::size_t nv = kernels.nv;
  const Eigen::Quaterniond R(q[6], q[3], q[4], q[5]);
  const Vector3 base(q[0], q[1], q[2]);
  const auto origin = [&](std::size_t site) -> Vector3 {
    return Eigen::Map<const Vector3>(&pose[12 * site + 9]);
  };
  const Vector3 between = 0.5 * (origin(feet.left) + origin(feet.right));
  // The wrench on the base in W's axes, about the base's origin, then about `between`.
  const Vector3 force = R * Vector3(tau[0], tau[1], tau[2]);
  const Vector3 moment = R * Vector3(tau[3], tau[4], tau[5]) - (between - base).cross(force);
  Wrench half;
  half << 0.5 * force, 0.5 * moment;
  for (const std::size_t site : {feet.left, feet.right}) {
    const double* rows = &J[6 * nv * site];
    for (std::size_t i = 6; i < nv; ++i) {
      for (std::size_t k = 0; k < 6; ++k) {
        tau[i] -= rows[k * nv + i] * half[static_cast<Eigen::Index>(k)];
      }
    }
  }
  for (std::size_t i = 0; i < 6; ++i) tau[i] = 0.0;
}

}  // namespace tandem
