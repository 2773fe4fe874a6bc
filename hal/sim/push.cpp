#include "hal/sim/push.hpp"

#include <algorithm>

namespace tandem::sim {

Pushes::Pushes(const model::Tree& tree, const tandem_kernels& kernels,
               const std::vector<std::string>& joints)
    : motion_(tree, kernels),
      body_force_(6 * motion_.bodies().size()),
      pushes_(FaultInjection::kMostFaults) {
  for (const std::string& name : joints)
    body_.push_back(static_cast<std::size_t>(tree.joint_index(name) + 1));
}

void Pushes::add(std::size_t joint, const Vec3& force_N, const Vec3& point_m) noexcept TANDEM_RT {
  if (joint >= body_.size() || count_ == pushes_.size()) return;
  pushes_[count_++] = {body_[joint], force_N, point_m};
}

void Pushes::add_forces(const double* q, const double* v, double* forces) noexcept TANDEM_RT {
  motion_.place(q, v);
  std::ranges::fill(body_force_, 0.0);
  for (std::size_t i = 0; i < count_; ++i) {
    const auto& [body, force, point] = pushes_[i];
    const TreeMotion::BodyMotion& at = motion_.bodies()[body];
    const Vec3 moment = cross(sum(at.p, rotate(at.R.data(), point.data())), force);
    for (std::size_t k = 0; k < 3; ++k) {
      body_force_[6 * body + k] += force[k];
      body_force_[6 * body + 3 + k] += moment[k];
    }
  }
  motion_.add_generalized(body_force_.data(), forces);
}

}  // namespace tandem::sim
