// Gains, impedance and amplifiers. A fault reset stays in the command until the drive's fault is
// gone.
#include "hal/service_devices.hpp"

#include "base/archive.hpp"
#include "hal/joint_access.hpp"

namespace tandem::hal {

Code PidControl::set_pid(std::size_t j, PidLoop loop, const PidGains& gains) noexcept TANDEM_RT {
  const PidGains most =
      j < io_.joints.size() ? io_.joints[j].most_gains[static_cast<std::size_t>(loop)] : PidGains{};
  for (const auto& [gain, limit] :
       {std::pair{gains.kp, most.kp}, {gains.ki, most.ki}, {gains.kd, most.kd}}) {
    const Code code = checked(io_, j, gain, 0.0, limit);
    if (code != Code::kOk) return code;
  }
  io_.parameters->set_gains(j, loop, gains);
  return Code::kOk;
}
PidGains PidControl::pid(std::size_t j, PidLoop loop) const noexcept TANDEM_RT {
  const double none = at({}, j);
  return j < io_.joints.size() ? io_.parameters->gains(j, loop) : PidGains{none, none, none};
}
double PidControl::error(std::size_t j, PidLoop loop) const noexcept TANDEM_RT {
  const CommandImage& command = *io_.command;
  switch (loop) {
    case PidLoop::kPosition:
      return at(command.position_rad(), j) - at(io_.state->position_rad(), j);
    case PidLoop::kVelocity:
      return at(command.velocity_rad_s(), j) - at(io_.state->velocity_rad_s(), j);
    case PidLoop::kTorque: return at(command.torque_Nm(), j) - at(io_.state->torque_Nm(), j);
    case PidLoop::kCurrent: break;
  }
  return at(command.current_A(), j) - at(io_.state->current_A(), j);
}

Code ImpedanceControl::set_impedance(std::size_t j, const Impedance& impedance) noexcept TANDEM_RT {
  const Impedance max = impedance_limits(j);
  const Code stiffness = checked(io_, j, impedance.stiffness_Nm_rad, 0.0, max.stiffness_Nm_rad);
  if (stiffness != Code::kOk) return stiffness;
  const Code damping = checked(io_, j, impedance.damping_Nms_rad, 0.0, max.damping_Nms_rad);
  if (damping != Code::kOk) return damping;
  if (!io_.joints[j].can(Capability::kCompliant)) return Code::kOutOfRange;
  io_.command->stiffness_Nm_rad()[j] = impedance.stiffness_Nm_rad;
  io_.command->damping_Nms_rad()[j] = impedance.damping_Nms_rad;
  return Code::kOk;
}
Impedance ImpedanceControl::impedance(std::size_t j) const noexcept TANDEM_RT {
  const CommandImage& command = *io_.command;
  return {at(command.stiffness_Nm_rad(), j), at(command.damping_Nms_rad(), j)};
}
Code ImpedanceControl::set_impedance_offset(std::size_t j, double Nm) noexcept TANDEM_RT {
  if (j >= io_.joints.size() || !io_.joints[j].can(Capability::kCompliant) ||
      in_mode(io_, j, ControlMode::kTorque)) {
    return Code::kOutOfRange;
  }
  const double max = io_.joints[j].max_torque_Nm;
  const Code code = checked(io_, j, Nm, -max, max);
  if (code == Code::kOk) io_.command->torque_Nm()[j] = Nm;
  return code;
}
double ImpedanceControl::impedance_offset_Nm(std::size_t j) const noexcept TANDEM_RT {
  if (j < io_.joints.size() && in_mode(io_, j, ControlMode::kTorque)) return 0.0;
  return at(std::as_const(*io_.command).torque_Nm(), j);
}
Impedance ImpedanceControl::impedance_limits(std::size_t j) const noexcept TANDEM_RT {
  if (j >= io_.joints.size()) return {at({}, j), at({}, j)};
  return {io_.joints[j].max_stiffness_Nm_rad, io_.joints[j].max_damping_Nms_rad};
}

Code AmplifierControl::enable(std::size_t j) noexcept TANDEM_RT {
  if (j >= io_.joints.size()) return Code::kOutOfRange;
  if (!in_mode(io_, j, ControlMode::kIdle)) return Code::kOk;
  seed_references(io_, j, enabled_mode_[j]);
  io_.command->mode()[j] = static_cast<std::int8_t>(enabled_mode_[j]);
  return Code::kOk;
}
Code AmplifierControl::disable(std::size_t j) noexcept TANDEM_RT {
  if (j >= io_.joints.size()) return Code::kOutOfRange;
  std::int8_t& mode = io_.command->mode()[j];
  if (mode != static_cast<std::int8_t>(ControlMode::kIdle)) {
    enabled_mode_[j] = static_cast<ControlMode>(mode);
  }
  mode = static_cast<std::int8_t>(ControlMode::kIdle);
  return Code::kOk;
}
DriveState AmplifierControl::status(std::size_t j) const noexcept TANDEM_RT {
  if (j >= io_.joints.size()) return DriveState::kUnknown;
  return static_cast<DriveState>(io_.state->drive_state()[j]);
}
double AmplifierControl::current_A(std::size_t j) const noexcept TANDEM_RT {
  return at(io_.state->current_A(), j);
}
double AmplifierControl::temperature_C(std::size_t j) const noexcept TANDEM_RT {
  return at(io_.state->temperature_C(), j);
}
double AmplifierControl::max_current_A(std::size_t j) const noexcept TANDEM_RT {
  return j < io_.joints.size() ? io_.joints[j].max_current_A : at({}, j);
}
std::uint32_t AmplifierControl::fault(std::size_t j) const noexcept TANDEM_RT {
  return j < io_.joints.size() ? io_.state->fault()[j] : 0;
}
Code AmplifierControl::reset_fault(std::size_t j) noexcept TANDEM_RT {
  if (j >= io_.joints.size()) return Code::kOutOfRange;
  io_.command->fault_reset()[j] = 1;
  resets_[j] = 1;
  return Code::kOk;
}

void AmplifierControl::advance() noexcept TANDEM_RT {
  for (std::size_t j = 0; j < io_.joints.size(); ++j) {
    if (resets_[j] == 0) continue;
    seed_references(io_, j, static_cast<ControlMode>(io_.command->mode()[j]));
    if (io_.state->fault()[j] == 0) io_.command->fault_reset()[j] = resets_[j] = 0;
  }
}

void AmplifierControl::archive(Archive& ar) { ar(enabled_mode_, resets_); }

}  // namespace tandem::hal
