#include "hal/command_limits.hpp"

#include <algorithm>
#include <cmath>

#include "base/archive.hpp"

namespace tandem::hal {
namespace {

bool in_operation(const StateImage& state, std::size_t joint) noexcept {
  return state.drive_state()[joint] == static_cast<std::uint8_t>(DriveState::kOperationEnabled);
}

bool is(ControlMode mode, std::int64_t value) noexcept {
  return value == static_cast<std::int64_t>(mode);
}

}  // namespace

CommandLimits::CommandLimits(const RobotConfig& robot, std::int64_t period_ns)
    : period_s_(static_cast<double>(period_ns) * 1e-9),
      limits_(joint_capabilities(robot)),
      last_(limits_.size()),
      counters_(limits_.size()),
      codes_(limits_.size(), Code::kOk) {}

Code CommandLimits::apply(const StateImage& state, CommandImage& command) noexcept TANDEM_RT {
  Code worst = Code::kOk;
  for (std::size_t j = 0; j < limits_.size(); ++j) {
    codes_[j] = Code::kOk;
    Last& last = last_[j];
    const JointCapabilities& limit = limits_[j];
    modes(j, command);
    position(j, state, command);
    double min_velocity = -limit.max_velocity_rad_s;
    double max_velocity = limit.max_velocity_rad_s;
    if (is(ControlMode::kVelocity, last.mode)) {
      if (state.position_rad()[j] >= limit.max_position_rad) max_velocity = 0.0;
      if (state.position_rad()[j] <= limit.min_position_rad) min_velocity = 0.0;
    }
    bounded(j, command.velocity_rad_s()[j], last.velocity_rad_s, min_velocity, max_velocity);
    bounded(j, command.torque_Nm()[j], last.torque_Nm, -limit.max_torque_Nm, limit.max_torque_Nm);
    bounded(j, command.voltage_V()[j], last.voltage_V, -limit.max_voltage_V, limit.max_voltage_V);
    bounded(j, command.current_A()[j], last.current_A, -limit.max_current_A, limit.max_current_A);
    bounded(j, command.stiffness_Nm_rad()[j], last.stiffness_Nm_rad, 0.0,
            limit.max_stiffness_Nm_rad);
    bounded(j, command.damping_Nms_rad()[j], last.damping_Nms_rad, 0.0, limit.max_damping_Nms_rad);
    if (codes_[j] == Code::kNotFinite || worst == Code::kOk) worst = codes_[j];
  }
  return worst;
}

void CommandLimits::follow(const CommandImage& command) noexcept TANDEM_RT {
  for (std::size_t j = 0; j < last_.size(); ++j) {
    last_[j] = {.position_rad = command.position_rad()[j],
                .velocity_rad_s = command.velocity_rad_s()[j],
                .torque_Nm = command.torque_Nm()[j],
                .voltage_V = command.voltage_V()[j],
                .current_A = command.current_A()[j],
                .stiffness_Nm_rad = command.stiffness_Nm_rad()[j],
                .damping_Nms_rad = command.damping_Nms_rad()[j],
                .mode = command.mode()[j],
                .interaction = command.interaction()[j]};
  }
}

void CommandLimits::modes(std::size_t joint, CommandImage& command) noexcept TANDEM_RT {
  Last& last = last_[joint];
  std::int8_t& mode = command.mode()[joint];
  std::uint8_t& interaction = command.interaction()[joint];
  const bool known = mode >= static_cast<std::int8_t>(ControlMode::kIdle) &&
                     mode <= static_cast<std::int8_t>(ControlMode::kCurrent) && interaction <= 1;
  if (!known) {
    mode = static_cast<std::int8_t>(last.mode);
    interaction = static_cast<std::uint8_t>(last.interaction);
    ++counters_[joint].not_finite;
    codes_[joint] = Code::kNotFinite;
  }
}

void CommandLimits::position(std::size_t joint, const StateImage& state,
                             CommandImage& command) noexcept TANDEM_RT {
  Last& last = last_[joint];
  const JointCapabilities& limit = limits_[joint];
  double& reference = command.position_rad()[joint];
  const double measured = state.position_rad()[joint];
  const bool wanted = is(ControlMode::kPosition, command.mode()[joint]);
  const bool closed = wanted && is(ControlMode::kPosition, last.mode) && in_operation(state, joint);
  if (!closed && std::isfinite(measured)) last.position_rad = measured;
  last.mode = command.mode()[joint];
  last.interaction = command.interaction()[joint];
  if (!wanted) {
    reference = last.position_rad;
    return;
  }
  const double from = last.position_rad;
  bounded(joint, reference, last.position_rad, limit.min_position_rad, limit.max_position_rad);
  const double step = limit.max_velocity_rad_s * period_s_;
  const double limited = std::clamp(reference, from - step, from + step);
  // A reference that runs at exactly the maximum velocity is not changed for its rounding.
  if (std::abs(limited - reference) > 1e-9 * step) {
    reference = limited;
    ++counters_[joint].too_fast;
  }
  last.position_rad = reference;
}

void CommandLimits::bounded(std::size_t joint, double& value, double& last, double min,
                            double max) noexcept TANDEM_RT {
  if (!std::isfinite(value)) {
    value = last;
    ++counters_[joint].not_finite;
    codes_[joint] = Code::kNotFinite;
  }
  if (value < min || value > max) {
    value = std::clamp(value, min, max);
    ++counters_[joint].out_of_range;
    if (codes_[joint] == Code::kOk) codes_[joint] = Code::kOutOfRange;
  }
  last = value;
}

void CommandLimits::archive(Archive& ar) { ar(last_, counters_, codes_); }

}  // namespace tandem::hal
