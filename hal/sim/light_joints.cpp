// Every 10 ms a unit torque on each watched joint gives its apparent inertia, and that the number
// of halvings of the sub-step.
#include "hal/sim/light_joints.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace tandem::sim {
double LightJoints::need_kg_m2(const ActuatorModel& motor, double link_damping_Nms_rad, double u_s,
                               double dampers) noexcept {
  const ActuatorModel& m = motor;
  const double back_emf =
      m.resistance_ohm > 0.0 ? m.torque_per_A * m.back_emf_Vs_rad / m.resistance_ohm : 0.0;
  const double motor_damping = m.friction_Nms_rad + back_emf;
  if (!m.elastic()) return dampers * u_s * (motor_damping + link_damping_Nms_rad);
  const double spring = u_s * u_s * m.spring_Nm_rad + dampers * u_s * m.spring_damping_Nms_rad;
  const double left_of_motor = m.inertia_kg_m2 - spring - u_s * motor_damping;
  if (!(left_of_motor > 0.0)) return std::numeric_limits<double>::infinity();
  return spring + spring * spring / left_of_motor + dampers * u_s * link_damping_Nms_rad;
}

LightJoints::LightJoints(const tandem_kernels& kernels, const Actuators& actuators,
                         std::span<const double> damping_Nms_rad,
                         std::span<const JointInertia> inertias, double stretch,
                         std::int64_t substep_ns)
    : joints_(kernels.joints) {
  rest_.assign(kernels.nv, 0.0);
  pushed_.assign(kernels.nv, 0.0);
  for (std::size_t joint = 0; joint < inertias.size(); ++joint) {
    Watched watched{.joint = joint, .need_kg_m2 = {}};
    for (std::size_t n = 0; n <= kHalvings; ++n) {
      const double u_s = static_cast<double>(substep_ns >> n) * 1e-9 / stretch;
      watched.need_kg_m2[n] = need_kg_m2(actuators.model(joint), damping_Nms_rad[joint], u_s);
    }
    if (watched.need_kg_m2[0] > kTaken * inertias[joint].least) watched_.push_back(watched);
  }
}

void LightJoints::look(AddedInertia& dynamics, const double* sines, const double* q,
                       const double* v, double* forces, const double* wrench,
                       std::int64_t time_ns) noexcept TANDEM_RT {
  next_look_ns_ = time_ns + kLook_ns;
  dynamics.forward_dynamics(sines, q, v, forces, wrench, rest_.data());
  std::size_t halvings = 0;
  for (const Watched& watched : watched_) {
    const std::size_t at = rest_.size() - joints_ + watched.joint;
    const double before = forces[at];
    forces[at] += 1.0;
    dynamics.forward_dynamics(sines, q, v, forces, wrench, pushed_.data());
    forces[at] = before;
    const double per_inertia = pushed_[at] - rest_[at];
    while (halvings < kHalvings && watched.need_kg_m2[halvings] * per_inertia > kTaken) ++halvings;
  }
  halvings_ = static_cast<std::int64_t>(halvings);
}

}  // namespace tandem::sim
