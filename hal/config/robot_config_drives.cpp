// [actuator.NAME] and [gains.NAME]: motors, springs and the drives' loops.
#include "hal/config/robot_config_read.hpp"

namespace tandem::hal {
namespace {

// A key a line.
// clang-format off
constexpr Key<ActuatorConfig> kActuator[] = {
  key<&ActuatorConfig::order>("order", {0, 3}, "0 rigid, 1 electrical, 2 mechanical (spring), 3 both"),
  required(key<&ActuatorConfig::resistance_ohm>("resistance_ohm", kPositive, "R, winding")),
  key<&ActuatorConfig::inductance_H>("inductance_H", kNotNegative, "L, winding; orders 1 and 3 need it"),
  required(key<&ActuatorConfig::torque_constant_Nm_A>("torque_constant_Nm_A", kPositive, "K, of the motor before the gear")),
  required(key<&ActuatorConfig::gear_ratio>("gear_ratio", kPositive, "N")),
  required(key<&ActuatorConfig::inertia_kg_m2>("inertia_kg_m2", kPositive, "J, reflected: N² times the rotor's. Of a rigid actuator (orders 0, 1) it is part of the joint's inertia, and its brake acts on it")),
  required(key<&ActuatorConfig::damping_Nms_rad>("damping_Nms_rad", kNotNegative, "D, **including** the back-EMF's share N²K²/R, which is subtracted again where the current is a state (orders 1, 3: at least that). In orders 0 and 2 less lowers the back-EMF; below half of it `check` and `run` warn")),
  key<&ActuatorConfig::friction_Nm>("friction_Nm", kNotNegative, "dry (Coulomb) friction, where D acts: on the rotor, reflected; on the joint where there is no spring (simulation: [simulation.md](simulation.md#dry-friction))"),
  key<&ActuatorConfig::spring_Nm_rad>("spring_Nm_rad", kNotNegative, "Ks; orders 2 and 3 need it"),
  key<&ActuatorConfig::spring_damping_Nms_rad>("spring_damping_Nms_rad", kNotNegative, "Ds"),
  required(key<&ActuatorConfig::current_limit_A>("current_limit_A", kPositive, "saturation of the motor's current")),
  required(key<&ActuatorConfig::voltage_limit_V>("voltage_limit_V", kPositive, "saturation of the motor's voltage")),
  key<&ActuatorConfig::thermal_resistance_K_W>("thermal_resistance_K_W", kPositive, "winding to ambient"),
  key<&ActuatorConfig::thermal_time_constant_s>("thermal_time_constant_s", kPositive, "of the winding"),
  key<&ActuatorConfig::continuous_current_A>("continuous_current_A", kNotNegative, "the drive's I2t limit (2031): the permanently permissible current; 0: not monitored"),
  key<&ActuatorConfig::thermal_time_s>("thermal_time_s", kPositive, "time constant of that monitor"),
  key<&ActuatorConfig::temperature_limit_C>("temperature_limit_C", {-50.0, 3000.0}, "of the winding (2034): the drive faults above it"),
};
// clang-format on

ActuatorConfig read_actuator(TomlTable& table) {
  ActuatorConfig a;
  read_keys(table, kActuator, a);
  a.damping_line = table.line("damping_Nms_rad");
  return a;
}

double read_gain(TomlTable& table, const char* key) {
  const double gain = table.number_or(key, 0.0);
  if (gain < 0.0) {
    table.error(key, "this gain has the wrong sign",
                "gains are not negative: they act on reference minus measurement");
  }
  return gain;
}

PidConfig read_pid(TomlTable table) {
  PidConfig pid;
  pid.gains = {read_gain(table, "kp"), read_gain(table, "ki"), read_gain(table, "kd")};
  pid.output_limit = table.number_or("output_limit", 0.0, kNotNegative);
  table.finish();
  return pid;
}

GainsConfig read_gains(TomlTable& table) {
  GainsConfig g;
  g.position = read_pid(table.table_or_empty("position"));
  g.velocity = read_pid(table.table_or_empty("velocity"));
  g.torque = read_pid(table.table_or_empty("torque"));
  g.current = read_pid(table.table_or_empty("current"));
  g.position_feedback = table.choice_or("position_feedback", "link", {"link", "motor"}) == "link"
                            ? PositionFeedback::kLink
                            : PositionFeedback::kMotor;
  g.torque_feedforward = table.number_or("torque_feedforward", 1.0, {0.0, 2.0});
  g.emf_compensation = table.number_or("emf_compensation", 0.0, {0.0, 1.0});
  g.stiffness_Nm_rad = read_gain(table, "stiffness_Nm_rad");
  g.damping_Nms_rad = read_gain(table, "damping_Nms_rad");
  return g;
}

void check_actuator(TomlTable& table, const ActuatorConfig& actuator) {
  if (table.has_errors()) return;  // what is wrong may follow from them
  const std::string problem = actuator_problem(actuator);
  if (problem.empty()) return;
  table.error("", "of order " + std::to_string(actuator.order) + ": " + problem,
              "give it, or another order");
}

}  // namespace

std::string actuator_problem(const ActuatorConfig& a) {
  const bool electrical = a.order == 1 || a.order == 3;
  const bool mechanical = a.order >= 2;
  if (electrical && a.inductance_H <= 0.0) return "inductance_H must be positive";
  if (mechanical && a.inertia_kg_m2 <= 0.0) return "inertia_kg_m2 must be positive";
  if (mechanical && a.spring_Nm_rad <= 0.0) return "spring_Nm_rad must be positive";
  const double emf = a.torque_per_A();
  if (electrical && a.resistance_ohm > 0.0 && a.damping_Nms_rad < emf * emf / a.resistance_ohm) {
    return "damping_Nms_rad must include the back-EMF's share N^2 K^2 / R = " +
           std::to_string(emf * emf / a.resistance_ohm);
  }
  return {};
}

double torque_rate_Nm_s(const JointConfig& joint) noexcept {
  constexpr double kFullTorques_s = 1000.0;
  return joint.max_torque_rate_Nm_s.value_or(kFullTorques_s * joint.max_torque_Nm);
}

double oscillation_limit_Nm(const JointConfig& joint, const ActuatorConfig& actuator) {
  const double most_Nm = actuator.torque_per_A() * actuator.current_limit_A;
  return joint.max_oscillation * std::min(joint.max_torque_Nm, most_Nm);
}

void read_drive_tables(TomlTable& root, RobotConfig& robot) {
  const TomlTable actuator_defaults = read_defaults(root, "actuator_defaults", read_actuator);
  TomlTable actuators = root.table_or_empty("actuator");
  for (const std::string& name : actuators.keys()) {
    TomlTable table = actuators.table(name);
    table.inherit(actuator_defaults);
    robot.actuators.push_back(read_actuator(table));
    robot.actuators.back().name = name;
    check_actuator(table, robot.actuators.back());
    table.finish();
  }
  actuators.finish();
  const TomlTable gains_defaults = read_defaults(root, "gains_defaults", read_gains);
  TomlTable gains = root.table_or_empty("gains");
  for (const std::string& name : gains.keys()) {
    TomlTable table = gains.table(name);
    table.inherit(gains_defaults);
    robot.gains.push_back(read_gains(table));
    robot.gains.back().name = name;
    robot.gains.back().line = table.line();
    table.finish();
  }
  gains.finish();
}

void describe_drives(KeyPage& page) { page.add("[actuator.NAME]", kActuator); }

}  // namespace tandem::hal
