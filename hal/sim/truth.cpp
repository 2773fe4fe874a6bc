// Copies base, joints, feet and loop errors of the plant into the truth image, once per cycle.
#include "hal/sim/truth.hpp"

#include <algorithm>

namespace tandem::sim {

void TruthFiller::fill(Plant& plant, const hal::CycleTime& time,
                       hal::TruthImage& truth) noexcept TANDEM_RT {
  truth.cycle()[0] = time.cycle;
  truth.time_ns()[0] = time.time_ns;
  truth.base_quaternion()[3] = 1.0;
  if (plant.kernels().floating_base != 0) {
    std::copy_n(plant.q(), 3, truth.base_position_m().data());
    std::copy_n(plant.q() + 3, 4, truth.base_quaternion().data());
    std::copy_n(plant.v(), 6, truth.base_velocity().data());
  }
  plant.center_of_mass(truth.center_of_mass_m().data(), com_velocity_.data(), com_jacobian_.data());
  for (std::size_t j = 0; j < plant.joints(); ++j) {
    const JointReading joint = plant.joint(j);
    truth.position_rad()[j] = joint.position_rad;
    truth.velocity_rad_s()[j] = joint.velocity_rad_s;
    truth.torque_Nm()[j] = joint.torque_Nm;
  }
  const Contact& contact = plant.contact();
  for (std::size_t f = 0; f < contact.feet(); ++f) {
    std::copy_n(plant.pose() + 12 * contact.site(f) + 9, 3, truth.foot_position_m().data() + 3 * f);
    const double* wrench = contact.wrench_W().data() + 6 * f;
    std::copy_n(wrench, 3, truth.foot_force_N().data() + 3 * f);
    std::copy_n(wrench + 3, 3, truth.foot_moment_Nm().data() + 3 * f);
  }
  for (std::size_t l = 0; l < truth.loops(); ++l) {
    truth.loop_position_error_m()[l] = plant.loops().position_error_m(l);
    truth.loop_velocity_error_m_s()[l] = plant.loops().velocity_error_m_s(l);
  }
  for (std::size_t j = 0; j < truth.passive(); ++j) {
    const tandem_kernels& k = plant.kernels();
    truth.passive_position_rad()[j] = plant.q()[k.nq - k.joints + plant.passive()[j]];
  }
  if (truth.ground_moves()) {
    const double time_s = 1e-9 * static_cast<double>(plant.time_ns());
    std::ranges::copy(contact.terrain().motion_at(time_s).position_m,
                      truth.ground_position_m().begin());
  }
  plant.pushes().sum_up(plant.q(), plant.v(), truth.center_of_mass_m().data(),
                        truth.push_force_N().data(), truth.push_moment_Nm().data());
  truth.hoist_share()[0] = plant.hoist_share();
}

}  // namespace tandem::sim
