// The equations of the four actuator orders (docs/simulation.md), brake and winding temperature.
// The steps of a current that is a state and of the temperature are exact.
#include "hal/sim/actuator.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <string>

#include "base/decay.hpp"
#include "base/wide.hpp"

namespace tandem::sim {
namespace {

constexpr double kBrakeFrequency_rad_s = 150.0;  // of a rigid joint's brake on its armature

Status require_positive(const hal::ActuatorConfig& config, double value, const char* key) {
  if (value > 0.0 && std::isfinite(value)) return {};
  return std::unexpected(Error{.message = "actuator of order " + std::to_string(config.order) +
                                          " needs " + std::string(key) + " above 0",
                               .hint = "set it, or choose an order that does without",
                               .file = {},
                               .key = "actuator." + config.name + "." + key});
}

double clamp_to(double value, double limit) {
  return limit > 0.0 ? std::clamp(value, -limit, limit) : value;
}

/// What flows with the bridge on.
template <class Elastic>
inline double order_2_current(const Elastic& m, std::size_t j, double voltage_V,
                              double velocity_rad_s) {
  const double i = (voltage_V - m.back_emf[j] * velocity_rad_s) / m.resistance[j];
  const double limit = m.current_limit[j];
  const double above = i > -limit ? i : -limit;
  return above < limit ? above : limit;
}

}  // namespace

Result<ActuatorModel> make_actuator(const hal::ActuatorConfig& config) {
  if (config.order < 0 || config.order > 3) {
    return std::unexpected(Error{.message = "the order of an actuator is 0, 1, 2 or 3",
                                 .hint = "0 rigid, 1 electrical, 2 mechanical, 3 both",
                                 .file = {},
                                 .key = "actuator." + config.name + ".order"});
  }
  const bool elastic = config.order >= 2;
  const bool electrical = (config.order & 1) != 0;
  struct Need {
    bool needed;
    double value;
    const char* key;
  };
  for (const Need& need : {Need{true, config.resistance_ohm, "resistance_ohm"},
                           Need{true, config.torque_constant_Nm_A, "torque_constant_Nm_A"},
                           Need{true, config.gear_ratio, "gear_ratio"},
                           Need{true, config.inertia_kg_m2, "inertia_kg_m2"},
                           Need{electrical, config.inductance_H, "inductance_H"},
                           Need{elastic, config.spring_Nm_rad, "spring_Nm_rad"},
                           Need{true, config.thermal_time_constant_s, "thermal_time_constant_s"}}) {
    if (!need.needed) continue;
    if (Status status = require_positive(config, need.value, need.key); !status) {
      return std::unexpected(status.error());
    }
  }
  ActuatorModel model;
  model.order = config.order;
  model.torque_per_A = config.torque_per_A();
  model.resistance_ohm = config.resistance_ohm;
  const double emf = std::min(model.torque_per_A,
                              config.damping_Nms_rad * model.resistance_ohm / model.torque_per_A);
  model.back_emf_Vs_rad = emf;
  model.friction_Nms_rad =
      std::max(0.0, config.damping_Nms_rad - model.torque_per_A * emf / model.resistance_ohm);
  model.inductance_H = config.inductance_H;
  model.inertia_kg_m2 = config.inertia_kg_m2;
  model.spring_Nm_rad = config.spring_Nm_rad;
  model.spring_damping_Nms_rad = config.spring_damping_Nms_rad;
  model.current_limit_A = config.current_limit_A;
  model.voltage_limit_V = config.voltage_limit_V;
  model.thermal_resistance_K_W = config.thermal_resistance_K_W;
  model.thermal_time_constant_s = config.thermal_time_constant_s;
  return model;
}

double armature(const hal::ActuatorConfig& config) {
  return config.order < 2 ? config.inertia_kg_m2 : 0.0;
}

Actuators::Actuators(std::vector<ActuatorModel> models, double ambient_C)
    : models_(std::move(models)), ambient_C_(ambient_C) {
  const std::size_t n = models_.size();
  voltage_.assign(n, 0.0);
  brake_rad_.assign(n, 0.0);
  brake_Nm_.assign(n, 0.0);
  temperature_.assign(n, ambient_C);
  bridge_.assign(n, 0.0);
  free_.assign(n, 1.0);
  whole_.assign(n, 1.0);
  cooling_.assign(n, 1.0);
  kick_s_.assign(n, 0.0);
  limited_kick_s_.assign(n, 0.0);
  limit_V_.assign(n, 0.0);
  brakes_.resize(n);
  brake_states_.resize(n);
  for (const ActuatorModel& model : models_) all_elastic_ &= model.order == 2;
  const auto array = [&](auto value) {
    std::vector<double> values(n);
    std::ranges::transform(models_, values.begin(),
                           [&](const ActuatorModel& model) { return std::invoke(value, model); });
    return values;
  };
  using Model = ActuatorModel;
  elastic_ = {
      .torque_per_A = array(&Model::torque_per_A),
      .back_emf = array(&Model::back_emf_Vs_rad),
      .friction = array(&Model::friction_Nms_rad),
      .resistance = array(&Model::resistance_ohm),
      .inertia = array(&Model::inertia_kg_m2),
      .spring = array(&Model::spring_Nm_rad),
      .spring_damping = array(&Model::spring_damping_Nms_rad),
      .current_limit = array([](const Model& m) {
        return m.current_limit_A > 0.0 ? m.current_limit_A
                                       : std::numeric_limits<double>::infinity();
      }),
      .heating = array([](const Model& m) { return m.thermal_resistance_K_W * m.resistance_ohm; })};
}

void Actuators::set_drive(std::size_t joint, double voltage_V, bool bridge_on) noexcept TANDEM_RT {
  voltage_[joint] = bridge_on ? clamp_to(voltage_V, models_[joint].voltage_limit_V) : 0.0;
  bridge_[joint] = bridge_on ? 1.0 : 0.0;
}

void Actuators::set_brake(std::size_t joint, bool engaged, double position_rad,
                          double load_Nm) noexcept TANDEM_RT {
  free_[joint] = engaged ? 0.0 : 1.0;
  brake_rad_[joint] = position_rad;
  brake_Nm_[joint] = load_Nm;
}

void Actuators::fit_brake(std::size_t joint, const hal::BrakeConfig& brake, double substep_s) {
  constexpr std::int64_t kNsPerMs = 1'000'000;
  const double J = models_[joint].inertia_kg_m2;
  brakes_[joint] = {.law = DryFriction::fit(brake.torque_Nm, J, substep_s),
                    .release_ns = brake.release_ms * kNsPerMs,
                    .engage_ns = brake.engage_ms * kNsPerMs};
  brake_states_[joint] = {.closed = 1};
  any_brake_ = true;
}

void Actuators::fit_friction(std::size_t joint, double friction_Nm, double inertia_kg_m2,
                             double substep_s) {
  frictions_.resize(size());
  friction_anchors_rad_.resize(size());
  frictions_[joint] = DryFriction::fit(friction_Nm, inertia_kg_m2, substep_s);
}

Actuators::DryFriction Actuators::DryFriction::fit(double torque_Nm, double inertia_kg_m2,
                                                   double substep_s) {
  return {.torque_Nm = torque_Nm,
          .stiffness_Nm_rad = inertia_kg_m2 * (0.4 / substep_s) * (0.4 / substep_s),
          .damping_Nms_rad = 0.3 * inertia_kg_m2 / substep_s};
}

double Actuators::DryFriction::torque(double anchor_rad, double position_rad,
                                      double velocity_rad_s) const noexcept {
  const double spring = clamp_to(stiffness_Nm_rad * (anchor_rad - position_rad), torque_Nm);
  return clamp_to(spring - damping_Nms_rad * velocity_rad_s, torque_Nm);
}

void Actuators::DryFriction::drag(double& anchor_rad, double position_rad) const noexcept {
  const double reach = torque_Nm / stiffness_Nm_rad;
  anchor_rad = std::clamp(anchor_rad, position_rad - reach, position_rad + reach);
}

void Actuators::seat_brakes(const double* position_rad) noexcept {
  for (std::size_t j = 0; j < brakes_.size(); ++j) brake_states_[j].anchor_rad = position_rad[j];
  std::copy_n(position_rad, frictions_.size(), friction_anchors_rad_.begin());
}

void Actuators::set_coil(std::size_t joint, bool current) noexcept TANDEM_RT {
  BrakeState& state = brake_states_[joint];
  const std::int64_t coil = current ? 1 : 0;
  if (state.coil != coil) state.since_ns = 0;
  state.coil = coil;
}

void Actuators::obey_coil(std::size_t joint, double position_rad) noexcept {
  BrakeState& state = brake_states_[joint];
  const Brake& brake = brakes_[joint];
  if (state.coil != 0 && state.since_ns >= brake.release_ns) state.closed = 0;
  if (state.coil != 0 || state.closed != 0 || state.since_ns < brake.engage_ns) return;
  state.closed = 1;
  state.anchor_rad = position_rad;
}

void Actuators::advance_brakes(std::int64_t step_ns,
                               const double* position_rad) noexcept TANDEM_RT {
  for (std::size_t j = 0; j < frictions_.size(); ++j) {
    if (frictions_[j].torque_Nm > 0.0)
      frictions_[j].drag(friction_anchors_rad_[j], position_rad[j]);
  }
  if (!any_brake_) return;
  for (std::size_t j = 0; j < brakes_.size(); ++j) {
    const Brake& brake = brakes_[j];
    if (!(brake.law.torque_Nm > 0.0)) continue;
    BrakeState& state = brake_states_[j];
    state.since_ns += step_ns;
    obey_coil(j, position_rad[j]);
    brake.law.drag(state.anchor_rad, position_rad[j]);
  }
}

/// Torque of the joint's brake and its friction.
double Actuators::dry_torque(std::size_t joint, double position_rad,
                             double velocity_rad_s) const noexcept {
  double torque_Nm = 0.0;
  if (const BrakeState& state = brake_states_[joint]; state.closed != 0)
    torque_Nm = brakes_[joint].law.torque(state.anchor_rad, position_rad, velocity_rad_s);
  if (!frictions_.empty() && frictions_[joint].torque_Nm > 0.0) {
    torque_Nm +=
        frictions_[joint].torque(friction_anchors_rad_[joint], position_rad, velocity_rad_s);
  }
  return torque_Nm;
}

double Actuators::current(std::size_t joint, double velocity_rad_s) const noexcept {
  if (bridge_[joint] == 0.0) return 0.0;
  const ActuatorModel& m = models_[joint];
  const double i = (voltage_[joint] - m.back_emf_Vs_rad * velocity_rad_s) / m.resistance_ohm;
  return clamp_to(i, m.current_limit_A);
}

double Actuators::rigid_brake(std::size_t joint, double q, double qd) const noexcept {
  const double J = models_[joint].inertia_kg_m2;
  return brake_Nm_[joint] -
         J * kBrakeFrequency_rad_s * (kBrakeFrequency_rad_s * (q - brake_rad_[joint]) + 2.0 * qd);
}

void Actuators::evaluate(const double* q, const double* qd, MotorStateView motor,
                         const double* spring_rad_s, double* torque_Nm,
                         MotorState rate) const noexcept TANDEM_RT {
  if (all_elastic()) return evaluate_elastic(q, qd, motor, spring_rad_s, torque_Nm, rate);
  for (std::size_t j = 0; j < models_.size(); ++j) {
    const ActuatorModel& m = models_[j];
    const double velocity = m.elastic() ? motor.velocity_rad_s[j] : qd[j];
    double i = 0.0;
    rate.current_A[j] = 0.0;
    if (!m.current_is_state()) {
      i = current(j, velocity);
    } else if (bridge_[j] != 0.0) {
      i = motor.current_A[j];
      rate.current_A[j] =
          (voltage_[j] - m.resistance_ohm * i - m.back_emf_Vs_rad * velocity) / m.inductance_H;
    }
    double drive = m.torque_per_A * i - m.friction_Nms_rad * velocity;
    if (brake_states_[j].closed != 0 || !frictions_.empty()) {
      drive += dry_torque(j, m.elastic() ? motor.position_rad[j] : q[j], velocity);
    }
    if (!m.elastic()) {
      rate.position_rad[j] = 0.0;
      rate.velocity_rad_s[j] = 0.0;
      torque_Nm[j] = braked(j) ? rigid_brake(j, q[j], qd[j]) : drive;
      continue;
    }
    const double spring = whole_[j] * (m.spring_Nm_rad * (motor.position_rad[j] - q[j]) +
                                       m.spring_damping_Nms_rad * (spring_rad_s[j] - qd[j]));
    torque_Nm[j] = spring;
    rate.position_rad[j] = free_[j] * velocity;
    rate.velocity_rad_s[j] = free_[j] * ((drive - spring) / m.inertia_kg_m2);
  }
}

void Actuators::fit_kick(double h_s) noexcept {
  kick_h_s_ = h_s;
  for (std::size_t j = 0; j < models_.size(); ++j) {
    const ActuatorModel& m = models_[j];
    const auto fit = [&](double damping_Nms_rad) {
      const double rate = damping_Nms_rad / m.inertia_kg_m2;
      return h_s * rate > 1e-12 ? (1.0 - decay(h_s * rate)) / rate : h_s;
    };
    const double back_emf =
        m.current_is_state() ? 0.0 : m.torque_per_A * m.back_emf_Vs_rad / m.resistance_ohm;
    kick_s_[j] = fit(m.friction_Nms_rad + back_emf);
    limited_kick_s_[j] = fit(m.friction_Nms_rad);
    limit_V_[j] = elastic_.current_limit[j] * m.resistance_ohm;
  }
}

void Actuators::kick(double h_s, MotorStateView rate, MotorState motor) noexcept TANDEM_RT {
  if (h_s != kick_h_s_) fit_kick(h_s);
  if (all_elastic()) return kick_elastic(rate, motor);
  for (std::size_t j = 0; j < models_.size(); ++j) {
    const ActuatorModel& m = models_[j];
    if (!m.elastic() || braked(j)) continue;
    const double driven_V = voltage_[j] - m.back_emf_Vs_rad * motor.velocity_rad_s[j];
    const bool limited = !m.current_is_state() && std::abs(driven_V) > limit_V_[j];
    motor.velocity_rad_s[j] += (limited ? limited_kick_s_[j] : kick_s_[j]) * rate.velocity_rad_s[j];
  }
}

void Actuators::drift(double h_s, const double* q, MotorState motor) const noexcept TANDEM_RT {
  const double* free = free_.data();
  for (std::size_t j = 0; j < size(); ++j)
    motor.position_rad[j] += h_s * free[j] * motor.velocity_rad_s[j];
  if (all_elastic()) return;
  for (std::size_t j = 0; j < models_.size(); ++j) {
    const ActuatorModel& m = models_[j];
    if (!m.elastic()) motor.position_rad[j] = q[j];
    if (!m.current_is_state() || bridge_[j] == 0.0) continue;
    const double settled =
        (voltage_[j] - m.back_emf_Vs_rad * motor.velocity_rad_s[j]) / m.resistance_ohm;
    const double time_constants = h_s * m.resistance_ohm / m.inductance_H;
    const double before = motor.current_A[j], left = decay(time_constants);
    motor.current_A[j] = settled + (before - settled) * left;
    if (!m.elastic() || braked(j)) continue;
    // Kicks go by the currents at the step's ends; the rotor has felt their mean.
    const double mean = settled + (before - settled) * (1.0 - left) / time_constants;
    const double ends = 0.5 * (before + motor.current_A[j]);
    if (clamp_to(motor.current_A[j], m.current_limit_A) == motor.current_A[j])
      motor.velocity_rad_s[j] += h_s * m.torque_per_A * (mean - ends) / m.inertia_kg_m2;
  }
}

void Actuators::finish_step(double h_s, const double* q, const double* qd,
                            MotorState motor) noexcept TANDEM_RT {
  cool(h_s);
  if (all_elastic()) return finish_elastic(motor);
  for (std::size_t j = 0; j < models_.size(); ++j) {
    const ActuatorModel& m = models_[j];
    if (!m.elastic()) {
      motor.position_rad[j] = q[j];
      motor.velocity_rad_s[j] = qd[j];
    } else if (braked(j)) {
      motor.velocity_rad_s[j] = 0.0;
    }
    double& i = motor.current_A[j];
    if (!m.current_is_state()) {
      i = current(j, motor.velocity_rad_s[j]);
    } else {
      i = bridge_[j] != 0.0 ? clamp_to(i, m.current_limit_A) : 0.0;
    }
    const double warm = ambient_C_ + m.thermal_resistance_K_W * m.resistance_ohm * i * i;
    temperature_[j] = warm + (temperature_[j] - warm) * cooling_[j];
  }
}

void Actuators::cool(double h_s) noexcept {
  if (h_s == cooling_h_s_) return;
  cooling_h_s_ = h_s;
  for (std::size_t j = 0; j < models_.size(); ++j) {
    cooling_[j] = decay(h_s / models_[j].thermal_time_constant_s);
  }
}

// The loops below have the bits of the loops over joints, without a branch.
Actuators::Elastic<const double*> Actuators::pointers(const Elastic<std::vector<double>>& m) {
  return {m.torque_per_A.data(),   m.back_emf.data(),      m.friction.data(),
          m.resistance.data(),     m.inertia.data(),       m.spring.data(),
          m.spring_damping.data(), m.current_limit.data(), m.heating.data()};
}

TANDEM_WIDE void Actuators::evaluate_elastic(const double* q, const double* qd,
                                             MotorStateView motor, const double* spring_rad_s,
                                             double* torque_Nm, MotorState rate) const noexcept {
  const Elastic<const double*> m = pointers(elastic_);
  const double *bridge = bridge_.data(), *free = free_.data(), *whole = whole_.data();
  const double* voltage = voltage_.data();
  const std::size_t n = size();
  TANDEM_EACH_ALONE
  for (std::size_t j = 0; j < n; ++j) {
    const double velocity = motor.velocity_rad_s[j];
    const double current = bridge[j] * order_2_current(m, j, voltage[j], velocity);
    const double spring = whole[j] * (m.spring[j] * (motor.position_rad[j] - q[j]) +
                                      m.spring_damping[j] * (spring_rad_s[j] - qd[j]));
    const double drive = m.torque_per_A[j] * current - m.friction[j] * velocity;
    torque_Nm[j] = spring;
    rate.position_rad[j] = free[j] * velocity;
    rate.velocity_rad_s[j] = free[j] * ((drive - spring) / m.inertia[j]);
    rate.current_A[j] = 0.0;  // it is no state: nothing of it changes by itself
  }
}

TANDEM_WIDE void Actuators::kick_elastic(MotorStateView rate, MotorState motor) const noexcept {
  const double *kick = kick_s_.data(), *limited_kick = limited_kick_s_.data();
  const double *limit_V = limit_V_.data(), *voltage = voltage_.data();
  const double* back_emf = elastic_.back_emf.data();
  const std::size_t n = size();
  TANDEM_EACH_ALONE
  for (std::size_t j = 0; j < n; ++j) {
    const double driven_V = voltage[j] - back_emf[j] * motor.velocity_rad_s[j];
    const double of_it = std::abs(driven_V) > limit_V[j] ? limited_kick[j] : kick[j];
    motor.velocity_rad_s[j] += of_it * rate.velocity_rad_s[j];
  }
}

TANDEM_WIDE void Actuators::finish_elastic(MotorState motor) noexcept {
  const Elastic<const double*> m = pointers(elastic_);
  const double *bridge = bridge_.data(), *free = free_.data(), *voltage = voltage_.data();
  const double *cooling = cooling_.data(), ambient_C = ambient_C_;
  double* temperature = temperature_.data();
  const std::size_t n = size();
  TANDEM_EACH_ALONE
  for (std::size_t j = 0; j < n; ++j) {
    const double velocity = motor.velocity_rad_s[j] * free[j];
    const double current = bridge[j] * order_2_current(m, j, voltage[j], velocity);
    const double warm = ambient_C + m.heating[j] * current * current;
    motor.velocity_rad_s[j] = velocity;
    motor.current_A[j] = current;
    temperature[j] = warm + (temperature[j] - warm) * cooling[j];
  }
}

}  // namespace tandem::sim
