#include "hal/config/strength.hpp"

#include <algorithm>

namespace tandem::hal {
namespace {

double per_ampere(const ActuatorConfig& drive) {
  return drive.gear_ratio * drive.torque_constant_Nm_A;
}

}  // namespace

double strength_of(const JointConfig& joint, const ActuatorConfig& drive) {
  const double by_voltage = drive.voltage_limit_V / drive.resistance_ohm;
  return std::min(joint.max_torque_Nm,
                  per_ampere(drive) * std::min(drive.current_limit_A, by_voltage));
}

double lasting_strength_of(const JointConfig& joint, const ActuatorConfig& drive) {
  const double most = strength_of(joint, drive);
  if (!(drive.continuous_current_A > 0.0)) return most;
  return std::min(most, per_ampere(drive) * drive.continuous_current_A);
}

}  // namespace tandem::hal
