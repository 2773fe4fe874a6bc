// Outer loop by mode, torque limit and slope, torque loop, voltage limit; conditional integration
// and a decaying transfer voltage. docs/firmware.md has the laws.
#include "firmware_emu/joint_controller.hpp"

#include <cmath>

#include "base/decay.hpp"

namespace tandem::firmware {

using canopen::Mode;

namespace {

/// What is left of a decaying voltage. Halved for ever it would be a subnormal number one day, with
/// which CPUs compute a hundred times slower; long before that it changes no other number.
double decayed(double voltage_V, double factor) noexcept {
  constexpr double kNothing_V = 1e-300;
  const double left_V = voltage_V * factor;
  return std::abs(left_V) < kNothing_V ? 0.0 : left_V;
}

/// Shares of the velocity limit: from the first the current that may drive a joint on falls, with
/// the second it is none, beyond it brakes: the full torque limit after as much again. Over a fifth
/// of the limit, for a drive that knows its velocity 1.6 ms late is stable no steeper.
constexpr double kTaperFrom = 0.9;
constexpr double kTaperTo = 1.1;

}  // namespace

void JointController::configure(const canopen::DriveParameters& config,
                                double period_s) noexcept TANDEM_RT {
  config_ = config;
  period_s_ = period_s;
  transfer_decay_ = config.transfer_time_s > 0.0 ? decay(period_s / config.transfer_time_s) : 0.0;
  retuned_ = true;
}

bool JointController::cascaded() const noexcept {
  if (action_ == BridgeAction::kHold || action_ == BridgeAction::kRamp) return true;
  return action_ == BridgeAction::kFollow && mode_ != Mode::kOpenLoop && mode_ != Mode::kCurrent &&
         mode_ != Mode::kNone;
}

double JointController::update(BridgeAction action, Mode mode, const Reference& reference,
                               const Measurement& measured) noexcept TANDEM_RT {
  if (action == BridgeAction::kOff) {
    action_ = BridgeAction::kOff;
    mode_ = mode;
    terms_ = {};
    retuned_ = false;
    return 0.0;
  }
  terms_.reference_limited = 0;
  terms_.torque_saturation = 0;
  const bool change = action != action_ || (action == BridgeAction::kFollow && mode != mode_);
  double held_V = terms_.voltage_V;
  if (change) {
    // An open bridge shows the back-EMF at its terminals: that is the voltage without a current.
    if (action_ == BridgeAction::kOff) {
      held_V = config_.motor_constant_Nm_A * measured.motor_velocity_rad_s;
    }
    begin(action, mode, measured);
  }
  Step step;
  if (cascaded()) {
    cascade(reference, measured, change, step);
  } else {
    terms_.torque_reference_Nm = 0.0;
    if (action_ == BridgeAction::kFollow && mode_ == Mode::kCurrent) {
      current_loop(reference.current_A, measured, step);
    } else if (action_ == BridgeAction::kFollow && mode_ == Mode::kOpenLoop) {
      step.voltage_V = reference.voltage_V;
    }
  }
  terms_.transfer_V =
      change || retuned_ ? held_V - step.voltage_V : decayed(terms_.transfer_V, transfer_decay_);
  retuned_ = false;
  step.voltage_V += terms_.transfer_V;
  const Saturation cut = limit_voltage(step.voltage_V, measured);
  terms_.voltage_saturation = static_cast<std::int32_t>(cut);
  terms_.voltage_V = step.voltage_V;
  terms_.drive_current_A = current_of(step.voltage_V, measured);
  integrate(step, cut);
  return step.voltage_V;
}

void JointController::begin(BridgeAction action, Mode mode, const Measurement& measured) noexcept {
  if (!cascaded()) {  // the cascade starts from the torque that the spring carries now
    terms_.torque_reference_Nm = measured.torque_Nm;
    torque_.reset();
  }
  action_ = action;
  mode_ = mode;
  position_.reset();
  velocity_.reset();
  current_.reset();
  terms_.held_position_rad = measured.link_position_rad;
  terms_.ramp_velocity_rad_s = measured.link_velocity_rad_s;
  terms_.last_position_rad = measured.link_position_rad;
}

/// One period nearer to rest. The position is that of the mean velocity: exact on the ramp.
void JointController::advance_ramp() noexcept {
  const double before = terms_.ramp_velocity_rad_s;
  const double slower = std::abs(before) - config_.stop_deceleration_rad_s2 * period_s_;
  terms_.ramp_velocity_rad_s = slower > 0.0 ? std::copysign(slower, before) : 0.0;
  terms_.held_position_rad += 0.5 * (before + terms_.ramp_velocity_rad_s) * period_s_;
}

double JointController::limited_position(double position_rad) noexcept {
  // A joint that was enabled outside of its range is not pulled in: it may come, and not go back.
  const double min = std::min(config_.min_position_rad, terms_.last_position_rad);
  const double max = std::max(config_.max_position_rad, terms_.last_position_rad);
  if (saturate(position_rad, min, max) != Saturation::kNone) terms_.reference_limited = 1;
  terms_.last_position_rad = position_rad;
  return position_rad;
}

double JointController::limited_velocity(double velocity_rad_s, double position_rad) noexcept {
  const double limit = config_.velocity_limit_rad_s;
  if (limit > 0.0 && saturate(velocity_rad_s, -limit, limit) != Saturation::kNone) {
    terms_.reference_limited = 1;
  }
  const bool outward = (position_rad >= config_.max_position_rad && velocity_rad_s > 0.0) ||
                       (position_rad <= config_.min_position_rad && velocity_rad_s < 0.0);
  if (!outward) return velocity_rad_s;
  terms_.reference_limited = 1;
  return 0.0;
}

JointController::Outer JointController::position_outer(double position_rad, double velocity_rad_s,
                                                       double torque_Nm,
                                                       const Measurement& measured) noexcept {
  const double q_ref = limited_position(position_rad);
  const double link_error = q_ref - measured.link_position_rad;
  terms_.position_error_rad = link_error;
  double error = link_error;
  double rate = velocity_rad_s - measured.link_velocity_rad_s;
  if (config_.motor_feedback != 0.0) {
    const double deflection = config_.spring_Nm_rad > 0.0 ? torque_Nm / config_.spring_Nm_rad : 0.0;
    error = q_ref + deflection - measured.motor_position_rad;
    rate = velocity_rad_s - measured.motor_velocity_rad_s;
  }
  return {.torque_Nm = position_.apply(config_.position, error, rate) + torque_Nm,
          .integrand = link_error,
          .feedforward_Nm = torque_Nm,
          .loop = &position_,
          .config = &config_.position};
}

JointController::Outer JointController::velocity_outer(const Reference& reference,
                                                       const Measurement& measured) noexcept {
  const double v_ref = limited_velocity(reference.velocity_rad_s, measured.link_position_rad);
  const double error = v_ref - measured.link_velocity_rad_s;
  return {
      .torque_Nm = velocity_.apply(config_.velocity, error, -measured.link_acceleration_rad_s2) +
                   reference.torque_Nm,
      .integrand = error,
      .feedforward_Nm = reference.torque_Nm,
      .loop = &velocity_,
      .config = &config_.velocity};
}

double JointController::impedance_torque(double position_rad, double velocity_rad_s,
                                         const Reference& reference,
                                         const Measurement& measured) noexcept {
  const double error = limited_position(position_rad) - measured.link_position_rad;
  terms_.position_error_rad = error;
  return reference.stiffness_Nm_rad * error +
         reference.damping_Nms_rad * (velocity_rad_s - measured.link_velocity_rad_s) +
         reference.torque_Nm;
}

JointController::Outer JointController::outer_loop(const Reference& reference,
                                                   const Measurement& measured) noexcept {
  terms_.position_error_rad = 0.0;
  if (action_ == BridgeAction::kHold) {
    return position_outer(terms_.held_position_rad, 0.0, reference.torque_Nm, measured);
  }
  if (action_ == BridgeAction::kRamp) {
    advance_ramp();
    return position_outer(terms_.held_position_rad, terms_.ramp_velocity_rad_s, reference.torque_Nm,
                          measured);
  }
  switch (mode_) {
    case Mode::kCsp:
      return position_outer(reference.position_rad, reference.velocity_rad_s, reference.torque_Nm,
                            measured);
    case Mode::kCsv: return velocity_outer(reference, measured);
    case Mode::kImpedance:
      return {.torque_Nm = impedance_torque(reference.position_rad, reference.velocity_rad_s,
                                            reference, measured)};
    case Mode::kVelocityImpedance: {
      const double v_ref = limited_velocity(reference.velocity_rad_s, terms_.held_position_rad);
      return {.torque_Nm = impedance_torque(terms_.held_position_rad, v_ref, reference, measured),
              .integrand = v_ref};
    }
    case Mode::kCst:
    default: return {.torque_Nm = reference.torque_Nm};
  }
}

void JointController::cascade(const Reference& reference, const Measurement& measured, bool change,
                              Step& step) noexcept {
  const double held_Nm = terms_.torque_reference_Nm;
  const double error_rad = terms_.position_error_rad;
  Outer& outer = step.outer;
  outer = outer_loop(reference, measured);
  const bool by_velocity = action_ == BridgeAction::kFollow && mode_ == Mode::kCsv;
  const double approached_rad = change ? 0.0 : error_rad - terms_.position_error_rad;
  terms_.deviation_rad_s = by_velocity ? -outer.integrand : approached_rad / period_s_;
  if (change && outer.loop != nullptr && outer.config->ki > 0.0) {
    outer.torque_Nm =
        outer.loop->seed(*outer.config, held_Nm - outer.feedforward_Nm) + outer.feedforward_Nm;
  }
  double torque_Nm = outer.torque_Nm;
  terms_.torque_saturation = static_cast<std::int32_t>(limit_torque(torque_Nm, held_Nm));
  terms_.torque_reference_Nm = torque_Nm;
  step.torque_error_Nm = torque_Nm - measured.torque_Nm;
  step.voltage_V = config_.torque_to_voltage_V_Nm * torque_Nm +
                   config_.emf_compensation_Vs_rad * measured.motor_velocity_rad_s +
                   torque_.apply(config_.torque, step.torque_error_Nm, -measured.torque_rate_Nm_s);
}

// First the slope, then the limit: a limit that is lowered is obeyed at once.
Saturation JointController::limit_torque(double& torque_Nm, double last_Nm) const noexcept {
  const double step_Nm = config_.torque_slope_Nm_s * period_s_;
  const Saturation slope = saturate(torque_Nm, last_Nm - step_Nm, last_Nm + step_Nm);
  const Saturation limit = saturate(torque_Nm, -config_.torque_limit_Nm, config_.torque_limit_Nm);
  return limit != Saturation::kNone ? limit : slope;
}

void JointController::current_loop(double current_A, const Measurement& measured,
                                   Step& step) noexcept {
  if (saturate(current_A, -config_.current_limit_A, config_.current_limit_A) != Saturation::kNone) {
    terms_.reference_limited = 1;
  }
  step.current_error_A = current_A - measured.current_A;
  step.voltage_V = config_.resistance_ohm * current_A +
                   config_.motor_constant_Nm_A * measured.motor_velocity_rad_s +
                   current_.apply(config_.current, step.current_error_A, 0.0);
}

double JointController::current_of(double voltage_V, const Measurement& measured) const noexcept {
  if (!(config_.resistance_ohm > 0.0)) return 0.0;
  return (voltage_V - config_.motor_constant_Nm_A * measured.motor_velocity_rad_s) /
         config_.resistance_ohm;
}

double JointController::most_current_A(double way, const Measurement& measured) const noexcept {
  const double constant = config_.motor_constant_Nm_A;
  const bool limits_torque = constant > 0.0 && config_.torque_limit_Nm > 0.0;
  const double of_torque_A =
      limits_torque ? std::min(config_.current_limit_A, config_.torque_limit_Nm / constant)
                    : config_.current_limit_A;
  const bool direct =
      action_ == BridgeAction::kFollow && !cascaded();  // no torque reference to limit
  const double most_A = direct ? of_torque_A : config_.current_limit_A;
  // A shorted winding brakes without a sensor.
  if (!(config_.velocity_limit_rad_s > 0.0) || action_ == BridgeAction::kBrake) return most_A;
  // The motor's, which the current moves: by the link's a spring would be driven into swinging.
  const double share = way * measured.motor_velocity_rad_s / config_.velocity_limit_rad_s;
  if (share <= kTaperFrom) return most_A;
  return of_torque_A * std::max(-1.0, (kTaperTo - share) / (kTaperTo - kTaperFrom));
}

// First the current that this voltage would drive, then what the supply can give at all.
Saturation JointController::limit_voltage(double& voltage_V,
                                          const Measurement& measured) const noexcept {
  Saturation cut = Saturation::kNone;
  if (config_.resistance_ohm > 0.0) {
    const double emf_V = config_.motor_constant_Nm_A * measured.motor_velocity_rad_s;
    double low_A = -most_current_A(-1.0, measured);
    double high_A = most_current_A(1.0, measured);
    const bool direct = action_ == BridgeAction::kFollow && !cascaded() && mode_ != Mode::kNone;
    if (direct && config_.motor_constant_Nm_A > 0.0) {  // as the torque reference's slope
      const double step_A = config_.torque_slope_Nm_s / config_.motor_constant_Nm_A * period_s_;
      const double last_A = std::clamp(terms_.drive_current_A, low_A, high_A);
      low_A = std::max(low_A, last_A - step_A);
      high_A = std::min(high_A, last_A + step_A);
    }
    cut = saturate(voltage_V, emf_V + config_.resistance_ohm * low_A,
                   emf_V + config_.resistance_ohm * high_A);
  }
  const double supply_V = std::max(0.0, std::min(config_.voltage_limit_V, measured.bus_voltage_V));
  const Saturation supply_cut = saturate(voltage_V, -supply_V, supply_V);
  return supply_cut != Saturation::kNone ? supply_cut : cut;
}

void JointController::integrate(const Step& step, Saturation voltage_cut) noexcept {
  const Saturation outer_cut = terms_.torque_saturation != 0
                                   ? static_cast<Saturation>(terms_.torque_saturation)
                                   : voltage_cut;
  if (step.outer.loop != nullptr) {
    step.outer.loop->integrate(*step.outer.config, step.outer.integrand, period_s_, outer_cut);
  } else if (action_ == BridgeAction::kFollow && mode_ == Mode::kVelocityImpedance) {
    const double move = step.outer.integrand * period_s_;
    const bool winds_up = static_cast<double>(outer_cut) * move > 0.0;
    if (!winds_up) terms_.held_position_rad = limited_position(terms_.held_position_rad + move);
  }
  torque_.integrate(config_.torque, step.torque_error_Nm, period_s_, voltage_cut);
  current_.integrate(config_.current, step.current_error_A, period_s_, voltage_cut);
}

}  // namespace tandem::firmware
