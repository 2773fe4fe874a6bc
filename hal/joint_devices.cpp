// Thin, bounds-checked views of the images: setters write the command, getters read the state.
#include "hal/joint_devices.hpp"

#include <algorithm>

#include "base/archive.hpp"
#include "hal/joint_access.hpp"

namespace tandem::hal {

double Encoders::position_rad(std::size_t j) const noexcept TANDEM_RT {
  return at(io_.state->position_rad(), j);
}
double Encoders::velocity_rad_s(std::size_t j) const noexcept TANDEM_RT {
  return at(io_.state->velocity_rad_s(), j);
}
double Encoders::acceleration_rad_s2(std::size_t j) const noexcept TANDEM_RT {
  return at(io_.state->acceleration_rad_s2(), j);
}
std::int64_t Encoders::timestamp_ns(std::size_t j) const noexcept TANDEM_RT {
  if (j >= axes()) return -1;
  return io_.state->time_ns()[0] - io_.state->age_cycles()[j] * io_.period_ns;
}
double Encoders::motor_position_rad(std::size_t j) const noexcept TANDEM_RT {
  return at(io_.state->motor_position_rad(), j);
}
double Encoders::motor_velocity_rad_s(std::size_t j) const noexcept TANDEM_RT {
  return at(io_.state->motor_velocity_rad_s(), j);
}

Code ControlModes::set_control_mode(std::size_t j, ControlMode mode) noexcept TANDEM_RT {
  if (j >= io_.joints.size()) return Code::kOutOfRange;
  const auto interaction = static_cast<InteractionMode>(io_.command->interaction()[j]);
  if (!io_.joints[j].can(mode, interaction)) return Code::kOutOfRange;
  seed_references(io_, j, mode);
  io_.command->mode()[j] = static_cast<std::int8_t>(mode);
  return Code::kOk;
}
ControlMode ControlModes::control_mode(std::size_t j) const noexcept TANDEM_RT {
  if (j >= io_.joints.size()) return ControlMode::kIdle;
  return static_cast<ControlMode>(io_.state->mode()[j]);
}

Code InteractionModes::set_interaction_mode(std::size_t j,
                                            InteractionMode mode) noexcept TANDEM_RT {
  if (j >= io_.joints.size()) return Code::kOutOfRange;
  if (mode == InteractionMode::kCompliant && !io_.joints[j].can(Capability::kCompliant)) {
    return Code::kOutOfRange;
  }
  seed_references(io_, j, static_cast<ControlMode>(io_.command->mode()[j]));
  io_.command->interaction()[j] = static_cast<std::uint8_t>(mode);
  return Code::kOk;
}
InteractionMode InteractionModes::interaction_mode(std::size_t j) const noexcept TANDEM_RT {
  if (j >= io_.joints.size()) return InteractionMode::kStiff;
  return static_cast<InteractionMode>(io_.state->interaction()[j]);
}

Code PositionDirect::set_position(std::size_t j, double rad) noexcept TANDEM_RT {
  if (j >= io_.joints.size() || !in_mode(io_, j, ControlMode::kPosition)) {
    return Code::kOutOfRange;
  }
  const JointCapabilities& limit = io_.joints[j];
  const Code code = checked(io_, j, rad, limit.min_position_rad, limit.max_position_rad);
  if (code == Code::kOk) io_.command->position_rad()[j] = rad;
  return code;
}
double PositionDirect::ref_position_rad(std::size_t j) const noexcept TANDEM_RT {
  return at(std::as_const(*io_.command).position_rad(), j);
}

double TorqueControl::torque_Nm(std::size_t j) const noexcept TANDEM_RT {
  return at(io_.state->torque_Nm(), j);
}
Code TorqueControl::set_ref_torque(std::size_t j, double Nm) noexcept TANDEM_RT {
  if (j >= io_.joints.size() || !in_mode(io_, j, ControlMode::kTorque)) return Code::kOutOfRange;
  const double max = io_.joints[j].max_torque_Nm;
  const Code code = checked(io_, j, Nm, -max, max);
  if (code == Code::kOk) io_.command->torque_Nm()[j] = Nm;
  return code;
}
double TorqueControl::ref_torque_Nm(std::size_t j) const noexcept TANDEM_RT {
  return at(std::as_const(*io_.command).torque_Nm(), j);
}
double TorqueControl::max_torque_Nm(std::size_t j) const noexcept TANDEM_RT {
  return j < io_.joints.size() ? io_.joints[j].max_torque_Nm : at({}, j);
}

Code OpenLoopControl::set_ref_voltage(std::size_t j, double V) noexcept TANDEM_RT {
  if (j >= io_.joints.size() || !in_mode(io_, j, ControlMode::kOpenLoop)) {
    return Code::kOutOfRange;
  }
  const double max = io_.joints[j].max_voltage_V;
  const Code code = checked(io_, j, V, -max, max);
  if (code == Code::kOk) io_.command->voltage_V()[j] = V;
  return code;
}
double OpenLoopControl::ref_voltage_V(std::size_t j) const noexcept TANDEM_RT {
  return at(std::as_const(*io_.command).voltage_V(), j);
}
double OpenLoopControl::voltage_V(std::size_t j) const noexcept TANDEM_RT {
  return at(io_.state->voltage_V(), j);
}

Code CurrentControl::set_ref_current(std::size_t j, double A) noexcept TANDEM_RT {
  if (j >= io_.joints.size() || !in_mode(io_, j, ControlMode::kCurrent)) return Code::kOutOfRange;
  const double max = io_.joints[j].max_current_A;
  const Code code = checked(io_, j, A, -max, max);
  if (code == Code::kOk) io_.command->current_A()[j] = A;
  return code;
}
double CurrentControl::ref_current_A(std::size_t j) const noexcept TANDEM_RT {
  return at(std::as_const(*io_.command).current_A(), j);
}

}  // namespace tandem::hal
