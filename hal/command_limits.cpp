// Joint by joint, in every cycle: valid modes, then range and rate of each reference. A reference
// departs from the value that was sent last.
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

double acceleration_of(const JointCapabilities& limit) noexcept TANDEM_RT {
  return std::min(limit.max_acceleration_rad_s2, limit.max_velocity_rad_s / kFullScale_s);
}

/// Speed of a joint whose position loop closes; 0: it rests.
double speed_of(const StateImage& state, std::size_t joint,
                const JointCapabilities& limit) noexcept TANDEM_RT {
  const double most = limit.max_velocity_rad_s;
  const double measured = state.velocity_rad_s()[joint];
  return std::abs(measured) > kRestShare * most ? std::clamp(measured, -most, most) : 0.0;
}

/// A value on its way to a wish, which nobody has written since it was sent: to that wish.
void go_on(double& value, double sent, double wish) noexcept TANDEM_RT {
  if (sent != wish && value == sent) value = wish;
}

}  // namespace

CommandLimits::CommandLimits(const Robot& robot, std::int64_t period_ns)
    : period_s_(static_cast<double>(period_ns) * 1e-9),
      limits_(robot.joints.begin(), robot.joints.end()),
      last_(limits_.size()),
      position_(limits_.size()),
      velocity_(limits_.size()),
      counters_(limits_.size()),
      codes_(limits_.size(), Code::kOk),
      met_(limits_.size()) {}

Code CommandLimits::apply(const StateImage& state, CommandImage& command) noexcept TANDEM_RT {
  Code worst = Code::kOk;
  for (std::size_t j = 0; j < limits_.size(); ++j) {
    codes_[j] = Code::kOk;
    met_[j] = {};
    Last& last = last_[j];
    const Last was = last;
    modes(j, command);
    position(j, state, command);
    velocity(j, was, state, command);
    torque(j, was, state, command);
    direct(j, was, state, command);
    impedance(j, was, state, command);
    last.operates = in_operation(state, j) ? 1 : 0;
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
                .velocity_wish_rad_s = command.velocity_rad_s()[j],
                .torque_wish_Nm = command.torque_Nm()[j],
                .voltage_wish_V = command.voltage_V()[j],
                .current_wish_A = command.current_A()[j],
                .stiffness_wish_Nm_rad = command.stiffness_Nm_rad()[j],
                .damping_wish_Nms_rad = command.damping_Nms_rad()[j],
                .mode = command.mode()[j],
                .interaction = command.interaction()[j],
                .operates = 1};
    position_[j].begin(last_[j].position_rad, last_[j].velocity_rad_s);
    velocity_[j].begin(last_[j].velocity_rad_s);
  }
}

void CommandLimits::modes(std::size_t joint, CommandImage& command) noexcept TANDEM_RT {
  Last& last = last_[joint];
  std::int8_t& mode = command.mode()[joint];
  std::uint8_t& interaction = command.interaction()[joint];
  const bool known = mode >= static_cast<std::int8_t>(ControlMode::kIdle) &&
                     mode <= static_cast<std::int8_t>(ControlMode::kCurrent) && interaction <= 1;
  if (!known) {
    const bool is_mode = interaction <= 1;
    note(joint, {is_mode ? CommandField::kMode : CommandField::kInteraction, LimitKind::kNotFinite,
                 is_mode ? static_cast<double>(mode) : static_cast<double>(interaction)});
    mode = static_cast<std::int8_t>(last.mode);
    interaction = static_cast<std::uint8_t>(last.interaction);
    ++counters_[joint].not_finite;
    codes_[joint] = Code::kNotFinite;
  }
}

void CommandLimits::note(std::size_t joint, const Met& met) noexcept TANDEM_RT {
  const auto rank = [](LimitKind kind) {  // the two of speed are alike
    return kind == LimitKind::kAtEnd ? LimitKind::kTooFast : kind;
  };
  if (rank(met.kind) <= rank(met_[joint].kind)) return;
  met_[joint] = {.value = met.value,
                 .limit = met.limit,
                 .field = met.field,
                 .kind = met.kind,
                 .derivative = met.derivative,
                 .slides = static_cast<std::uint8_t>(limits_[joint].slides ? 1 : 0)};
}

/// What is too much of a position reference that moves too fast: velocity, acceleration or jerk.
void CommandLimits::note_speed(std::size_t joint, double reference, double asked_rad_s,
                               double before_rad_s, double most_rad_s) noexcept TANDEM_RT {
  const JointCapabilities& limit = limits_[joint];
  Met met{CommandField::kPosition, LimitKind::kTooFast, reference, most_rad_s, 1};
  if (std::abs(asked_rad_s) <= most_rad_s * (1.0 + 1e-9)) {
    const double asked_rad_s2 = std::abs(asked_rad_s - before_rad_s) / period_s_;
    const bool jerks =
        std::isfinite(limit.max_jerk_rad_s3) && asked_rad_s2 <= limit.max_acceleration_rad_s2;
    met.limit = jerks ? limit.max_jerk_rad_s3 : limit.max_acceleration_rad_s2;
    met.derivative = jerks ? 3 : 2;
  }
  note(joint, met);
}

void CommandLimits::position(std::size_t joint, const StateImage& state,
                             CommandImage& command) noexcept TANDEM_RT {
  Last& last = last_[joint];
  const JointCapabilities& limit = limits_[joint];
  double& reference = command.position_rad()[joint];
  const double measured = state.position_rad()[joint];
  const bool wanted = is(ControlMode::kPosition, command.mode()[joint]);
  const bool stiffens =
      last.interaction == static_cast<std::int64_t>(InteractionMode::kCompliant) &&
      command.interaction()[joint] == static_cast<std::uint8_t>(InteractionMode::kStiff);
  const bool closed =
      wanted && is(ControlMode::kPosition, last.mode) && !stiffens && in_operation(state, joint);
  if (!closed && std::isfinite(measured)) last.position_rad = measured;
  last.mode = command.mode()[joint];
  last.interaction = command.interaction()[joint];
  last.held_back = 0;
  if (!wanted) {
    reference = last.position_rad;
    return;
  }
  const double from = last.position_rad;
  const double min = std::min(limit.min_position_rad, from);
  const double max = std::max(limit.max_position_rad, from);
  const bool outside = from < limit.min_position_rad || from > limit.max_position_rad;
  const double speed = limit.max_velocity_rad_s * (outside ? kRecoveryShare : 1.0);
  bounded(joint, CommandField::kPosition, reference, last.position_rad, min, max);
  double limited = 0.0;
  if (std::isfinite(limit.max_acceleration_rad_s2)) {
    if (!closed) {
      position_[joint].begin(from,
                             in_operation(state, joint) ? speed_of(state, joint, limit) : 0.0);
    }
    limited = position_[joint].step(reference,
                                    {.min = min,
                                     .max = max,
                                     .velocity = speed,
                                     .acceleration = limit.max_acceleration_rad_s2,
                                     .jerk = limit.max_jerk_rad_s3},
                                    period_s_);
    last.held_back = limited != reference && !outside ? 1 : 0;
  } else {
    const double step = speed * period_s_;
    limited = std::clamp(reference, from - step, from + step);
    // A reference that runs at exactly the maximum velocity is not changed for its rounding.
    if (std::abs(limited - reference) <= 1e-9 * step) limited = reference;
  }
  if (limited != reference) {
    note_speed(joint, reference, (reference - from) / period_s_, closed ? last.speed_rad_s : 0.0,
               speed);
    ++counters_[joint].too_fast;
  }
  last.speed_rad_s = (limited - from) / period_s_;
  reference = limited;
  last.position_rad = reference;
}

/// A velocity may be so large that the joint stops at the end of its range with half of the
/// acceleration that it may have; the other half is for what it lags behind.
void CommandLimits::brake_before_ends(std::size_t joint, double position_rad,
                                      double& reference) noexcept TANDEM_RT {
  constexpr double kBrake_s = 0.1;  // from full speed, of a joint that declares no acceleration
  const JointCapabilities& limit = limits_[joint];
  const double acceleration =
      std::min(limit.max_acceleration_rad_s2, limit.max_velocity_rad_s / kBrake_s);
  const auto fastest = [&](double way) { return std::sqrt(acceleration * way); };
  const double up = limit.max_position_rad - position_rad;
  const double down = position_rad - limit.min_position_rad;
  double slower = reference;
  if (up >= 0.0) slower = std::min(slower, fastest(up));
  if (down >= 0.0) slower = std::max(slower, -fastest(down));
  if (slower != reference) {
    note(joint, {CommandField::kVelocity, LimitKind::kAtEnd, reference, slower});
    ++counters_[joint].too_fast;
  }
  reference = slower;
}

void CommandLimits::velocity(std::size_t joint, const Last& was, const StateImage& state,
                             CommandImage& command) noexcept TANDEM_RT {
  Last& last = last_[joint];
  const JointCapabilities& limit = limits_[joint];
  double& reference = command.velocity_rad_s()[joint];
  double min = -limit.max_velocity_rad_s;
  double max = limit.max_velocity_rad_s;
  const bool follows = is(ControlMode::kVelocity, last.mode);
  if (follows) {
    const double slow = limit.max_velocity_rad_s * kRecoveryShare;
    const double position = state.position_rad()[joint];
    if (position >= limit.max_position_rad) max = 0.0;
    if (position > limit.max_position_rad) min = -slow;
    if (position <= limit.min_position_rad) min = 0.0;
    if (position < limit.min_position_rad) max = slow;
  }
  go_on(reference, was.velocity_rad_s, was.velocity_wish_rad_s);
  bounded(joint, CommandField::kVelocity, reference, last.velocity_rad_s, min, max);
  last.velocity_wish_rad_s = reference;
  if (last.held_back != 0) reference = last.velocity_rad_s = std::clamp(last.speed_rad_s, min, max);
  if (!follows || !in_operation(state, joint)) return;
  brake_before_ends(joint, state.position_rad()[joint], reference);
  last.velocity_rad_s = reference;
  const bool closed = is(ControlMode::kVelocity, was.mode) && was.operates != 0;
  const double measured = state.velocity_rad_s()[joint];
  const double from = closed || !std::isfinite(measured) ? was.velocity_rad_s : measured;
  if (!std::isfinite(limit.max_jerk_rad_s3)) {
    rated(joint, CommandField::kVelocity, reference, last.velocity_rad_s, from,
          acceleration_of(limit) * period_s_);
  } else {
    if (!closed) velocity_[joint].begin(from);
    const double limited = velocity_[joint].step(reference,
                                                 {.min = min,
                                                  .max = max,
                                                  .velocity = limit.max_acceleration_rad_s2,
                                                  .acceleration = limit.max_jerk_rad_s3},
                                                 period_s_);
    if (limited != reference) {
      const bool jerks = std::abs(reference - from) <= limit.max_acceleration_rad_s2 * period_s_;
      note(joint, {CommandField::kVelocity, LimitKind::kTooFast, reference,
                   jerks ? limit.max_jerk_rad_s3 : limit.max_acceleration_rad_s2,
                   static_cast<std::uint8_t>(jerks ? 2 : 1)});
      ++counters_[joint].too_fast;
    }
    reference = last.velocity_rad_s = limited;
  }
  if (reference >= min && reference <= max) return;
  reference = last.velocity_rad_s = std::clamp(reference, min, max);  // at the end of its range
  velocity_[joint].begin(reference);
}

void CommandLimits::torque(std::size_t joint, const Last& was, const StateImage& state,
                           CommandImage& command) noexcept TANDEM_RT {
  Last& last = last_[joint];
  double& reference = command.torque_Nm()[joint];
  const double most = limits_[joint].max_torque_Nm;
  go_on(reference, was.torque_Nm, was.torque_wish_Nm);
  bounded(joint, CommandField::kTorque, reference, last.torque_Nm, -most, most);
  last.torque_wish_Nm = reference;
  if (!in_operation(state, joint)) return;
  const auto by_torque = [](const Last& sent) {  // not a torque beside a stiff loop's
    const bool moves =
        is(ControlMode::kPosition, sent.mode) || is(ControlMode::kVelocity, sent.mode);
    const bool yields = sent.interaction == static_cast<std::int64_t>(InteractionMode::kCompliant);
    return is(ControlMode::kTorque, sent.mode) || (moves && yields);
  };
  const bool starts = by_torque(last) && !(by_torque(was) && was.operates != 0);
  const double measured = state.torque_Nm()[joint];
  rated(joint, CommandField::kTorque, reference, last.torque_Nm,
        starts && std::isfinite(measured) ? measured : was.torque_Nm,
        limits_[joint].max_torque_rate_Nm_s * period_s_);
}

void CommandLimits::direct(std::size_t joint, const Last& was, const StateImage& state,
                           CommandImage& command) noexcept TANDEM_RT {
  Last& last = last_[joint];
  const JointCapabilities& limit = limits_[joint];
  const bool operates = in_operation(state, joint);
  const auto one = [&](ControlMode mode, double& value, double& sent, double& wish, double before,
                       double measured, double most, double rate) noexcept {
    const CommandField field =
        mode == ControlMode::kCurrent ? CommandField::kCurrent : CommandField::kVoltage;
    go_on(value, before, wish);
    bounded(joint, field, value, sent, -most, most);
    wish = value;
    if (!operates || !is(mode, last.mode)) return;
    const bool closed = is(mode, was.mode) && was.operates != 0;
    const double from = closed || !std::isfinite(measured) ? before : measured;
    rated(joint, field, value, sent, std::clamp(from, -most, most), rate * period_s_);
  };
  one(ControlMode::kOpenLoop, command.voltage_V()[joint], last.voltage_V, last.voltage_wish_V,
      was.voltage_V, state.voltage_V()[joint], limit.max_voltage_V, limit.max_voltage_rate_V_s);
  one(ControlMode::kCurrent, command.current_A()[joint], last.current_A, last.current_wish_A,
      was.current_A, state.current_A()[joint], limit.max_current_A, limit.max_current_rate_A_s);
}

void CommandLimits::impedance(std::size_t joint, const Last& was, const StateImage& state,
                              CommandImage& command) noexcept TANDEM_RT {
  Last& last = last_[joint];
  const JointCapabilities& limit = limits_[joint];
  double& stiffness = command.stiffness_Nm_rad()[joint];
  double& damping = command.damping_Nms_rad()[joint];
  go_on(stiffness, was.stiffness_Nm_rad, was.stiffness_wish_Nm_rad);
  go_on(damping, was.damping_Nms_rad, was.damping_wish_Nms_rad);
  bounded(joint, CommandField::kStiffness, stiffness, last.stiffness_Nm_rad, 0.0,
          limit.max_stiffness_Nm_rad);
  bounded(joint, CommandField::kDamping, damping, last.damping_Nms_rad, 0.0,
          limit.max_damping_Nms_rad);
  last.stiffness_wish_Nm_rad = stiffness;
  last.damping_wish_Nms_rad = damping;
  const auto compliant = static_cast<std::int64_t>(InteractionMode::kCompliant);
  if (last.interaction != compliant || was.interaction != compliant || was.operates == 0 ||
      !in_operation(state, joint)) {
    return;
  }
  const double share = period_s_ / kFullScale_s;
  rated(joint, CommandField::kStiffness, stiffness, last.stiffness_Nm_rad, was.stiffness_Nm_rad,
        limit.max_stiffness_Nm_rad * share);
  rated(joint, CommandField::kDamping, damping, last.damping_Nms_rad, was.damping_Nms_rad,
        limit.max_damping_Nms_rad * share);
}

void CommandLimits::rated(std::size_t joint, CommandField field, double& value, double& last,
                          double from, double step) noexcept TANDEM_RT {
  const double limited = std::clamp(value, from - step, from + step);
  if (std::abs(limited - value) <= 1e-9 * step) return;
  note(joint, {field, LimitKind::kTooFast, value, step / period_s_, 1});
  value = last = limited;
  ++counters_[joint].too_fast;
}

void CommandLimits::correct(std::size_t joint, CommandField field, double& value, double last,
                            double min, double max) noexcept TANDEM_RT {
  if (!std::isfinite(value)) {
    note(joint, {field, LimitKind::kNotFinite, value});
    value = last;
    ++counters_[joint].not_finite;
    codes_[joint] = Code::kNotFinite;
  }
  if (value < min || value > max) {
    note(joint, {field, LimitKind::kRange, value, value < min ? min : max});
    value = std::clamp(value, min, max);
    ++counters_[joint].out_of_range;
    if (codes_[joint] == Code::kOk) codes_[joint] = Code::kOutOfRange;
  }
}

void CommandLimits::archive(Archive& ar) {
  ar(last_, position_, velocity_, counters_, codes_, met_);
}

}  // namespace tandem::hal
