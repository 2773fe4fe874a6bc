// [actuator.NAME] and [gains.NAME]: motors, springs and the drives' loops.
#include "hal/config/robot_config_read.hpp"

namespace tandem::hal {
namespace {

ActuatorConfig read_actuator(TomlTable& table) {
  ActuatorConfig a;
  read_keys(table, keys::kActuator, a);
  a.damping_line = table.line("damping_Nms_rad");
  return a;
}

void check_sign(TomlTable& table, const char* key, double gain) {
  if (gain >= 0.0) return;
  table.error(key, "this gain has the wrong sign",
              "gains are not negative: they act on reference minus measurement");
}

PidConfig read_pid(TomlTable table) {
  PidConfig pid;
  read_keys(table, keys::kPid, pid.gains);
  read_whole(table, keys::kPidLimit, pid);
  check_sign(table, "kp", pid.gains.kp);
  check_sign(table, "ki", pid.gains.ki);
  check_sign(table, "kd", pid.gains.kd);
  return pid;
}

GainsConfig read_gains(TomlTable& table) {
  GainsConfig g;
  g.position = read_pid(table.table_or_empty("position"));
  g.velocity = read_pid(table.table_or_empty("velocity"));
  g.torque = read_pid(table.table_or_empty("torque"));
  g.current = read_pid(table.table_or_empty("current"));
  read_keys(table, keys::kGains, g);
  check_sign(table, "stiffness_Nm_rad", g.stiffness_Nm_rad);
  check_sign(table, "damping_Nms_rad", g.damping_Nms_rad);
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

}  // namespace tandem::hal
