#include "hal/config/strength.hpp"

#include <algorithm>

namespace tandem::hal {

double strength_of(const JointConfig& joint, const ActuatorConfig& drive) {
  const double by_voltage = drive.voltage_limit_V / drive.resistance_ohm;
  return std::min(joint.max_torque_Nm,
                  drive.torque_per_A() * std::min(drive.current_limit_A, by_voltage));
}

double lasting_strength_of(const JointConfig& joint, const ActuatorConfig& drive) {
  const double most = strength_of(joint, drive);
  if (!(drive.continuous_current_A > 0.0)) return most;
  return std::min(most, drive.torque_per_A() * drive.continuous_current_A);
}

}  // namespace tandem::hal
