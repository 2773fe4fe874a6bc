// Which capability a control mode needs, and whether gains keep their bounds.
#include "hal/joint_capabilities.hpp"

#include <cstdio>

namespace tandem::hal {
namespace {

Capability needed(ControlMode mode) noexcept TANDEM_RT {
  switch (mode) {
    case ControlMode::kVelocity: return Capability::kVelocity;
    case ControlMode::kTorque: return Capability::kTorque;
    case ControlMode::kOpenLoop: return Capability::kOpenLoop;
    case ControlMode::kCurrent: return Capability::kCurrent;
    case ControlMode::kIdle:
    case ControlMode::kPosition: break;
  }
  return Capability::kPosition;
}

}  // namespace

const char* to_string(Capability capability) noexcept {
  switch (capability) {
    case Capability::kPosition: return "position";
    case Capability::kVelocity: return "velocity";
    case Capability::kTorque: return "torque";
    case Capability::kCompliant: return "compliant";
    case Capability::kOpenLoop: return "open_loop";
    case Capability::kCurrent: return "current";
  }
  return "?";
}

bool JointCapabilities::can(ControlMode mode,
                            InteractionMode interaction) const noexcept TANDEM_RT {
  if (mode == ControlMode::kIdle) return true;
  const bool known = mode >= ControlMode::kIdle && mode <= ControlMode::kCurrent &&
                     interaction <= InteractionMode::kCompliant;
  if (!known || !can(needed(mode))) return false;
  return interaction == InteractionMode::kStiff || can(Capability::kCompliant);
}

std::string gains_problem(const JointCapabilities& joint, PidLoop loop, const PidGains& gains) {
  const PidGains& most = joint.most_gains[static_cast<std::size_t>(loop)];
  const auto beyond = [](const char* what, double value, double limit) {
    char text[96];
    std::snprintf(text, sizeof text,
                  "%s = %g is beyond %g, the most that the joint's limits can use", what, value,
                  limit);
    return std::string(text);
  };
  if (!(gains.kp <= most.kp)) return beyond("kp", gains.kp, most.kp);
  if (!(gains.ki <= most.ki)) return beyond("ki", gains.ki, most.ki);
  if (!(gains.kd <= most.kd)) return beyond("kd", gains.kd, most.kd);
  return {};
}

}  // namespace tandem::hal
