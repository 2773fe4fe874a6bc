// Checks and seeds that the joint interfaces share.
// Layer: hal.  Thread: the one that owns the images.
#pragma once

#include <cmath>
#include <limits>

#include "hal/joint_devices.hpp"

namespace tandem::hal {

/// Element `j` of a field, or NaN when there is no such joint.
[[nodiscard]] inline double at(std::span<const double> field, std::size_t j) noexcept TANDEM_RT {
  return j < field.size() ? field[j] : std::numeric_limits<double>::quiet_NaN();
}

[[nodiscard]] inline bool in_mode(const JointAccess& io, std::size_t j,
                                  ControlMode mode) noexcept TANDEM_RT {
  return io.command->mode()[j] == static_cast<std::int8_t>(mode);
}

/// Whether `value` may be written: the rules of joint_devices.hpp.
[[nodiscard]] inline Code checked(const JointAccess& io, std::size_t j, double value, double min,
                                  double max) noexcept TANDEM_RT {
  if (!std::isfinite(value)) return Code::kNotFinite;
  return j < io.joints.size() && value >= min && value <= max ? Code::kOk : Code::kOutOfRange;
}

/// Sets every reference of a joint to what is measured, feed-forward and offsets to zero.
inline void seed_references(JointAccess& io, std::size_t j, ControlMode mode) noexcept TANDEM_RT {
  const StateImage& state = *io.state;
  io.command->position_rad()[j] = state.position_rad()[j];
  io.command->velocity_rad_s()[j] = 0.0;
  io.command->torque_Nm()[j] = mode == ControlMode::kTorque ? state.torque_Nm()[j] : 0.0;
  io.command->voltage_V()[j] = mode == ControlMode::kOpenLoop ? state.voltage_V()[j] : 0.0;
  io.command->current_A()[j] = mode == ControlMode::kCurrent ? state.current_A()[j] : 0.0;
}

}  // namespace tandem::hal
