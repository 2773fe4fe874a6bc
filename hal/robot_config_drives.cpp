#include <cmath>
#include <limits>

#include "hal/robot_config_read.hpp"

namespace tandem::hal {
namespace {

constexpr double kUnset = std::numeric_limits<double>::quiet_NaN();

void read_actuator(TomlTable table, const std::string& name, RobotConfig& robot) {
  ActuatorConfig a;
  a.name = name;
  a.order = static_cast<int>(table.integer_or("order", 2, 0, 3));
  a.resistance_ohm = table.number("resistance_ohm", kPositive);
  a.inductance_H = table.number_or("inductance_H", 0.0, kNotNegative);
  a.torque_constant_Nm_A = table.number("torque_constant_Nm_A", kPositive);
  a.gear_ratio = table.number("gear_ratio", kPositive);
  a.inertia_kg_m2 = table.number("inertia_kg_m2", kNotNegative);
  a.damping_Nms_rad = table.number("damping_Nms_rad", kNotNegative);
  a.spring_Nm_rad = table.number_or("spring_Nm_rad", 0.0, kNotNegative);
  a.spring_damping_Nms_rad = table.number_or("spring_damping_Nms_rad", 0.0, kNotNegative);
  a.current_limit_A = table.number("current_limit_A", kPositive);
  a.voltage_limit_V = table.number("voltage_limit_V", kPositive);
  a.thermal_resistance_K_W = table.number_or("thermal_resistance_K_W", 1.0, kPositive);
  a.thermal_time_constant_s = table.number_or("thermal_time_constant_s", 60.0, kPositive);
  a.continuous_current_A = table.number_or("continuous_current_A", 0.0, kNotNegative);
  a.thermal_time_s = table.number_or("thermal_time_s", a.thermal_time_s, kPositive);
  a.temperature_limit_C =
      table.number_or("temperature_limit_C", a.temperature_limit_C, {-50.0, 3000.0});
  const std::string problem = actuator_problem(a);
  if (!problem.empty()) {
    table.error("", "of order " + std::to_string(a.order) + ": " + problem,
                "give it, or another order");
  }
  table.finish();
  robot.actuators.push_back(a);
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

void read_gains(TomlTable table, const std::string& name, RobotConfig& robot) {
  GainsConfig g;
  g.name = name;
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
  table.finish();
  robot.gains.push_back(g);
}

StopCategory read_stop_category(TomlTable& table, StopCategory value) {
  static const std::vector<std::string> kNames{"category0", "category1", "hold", "warn"};
  const auto found =
      std::ranges::find(kNames, table.choice_or("on_fault", to_string(value), kNames));
  return static_cast<StopCategory>(found - kNames.begin());
}

void read_following(TomlTable& table, JointConfig& joint) {
  joint.following_error_rad =
      table.number_or("following_error_rad", joint.following_error_rad, kNotNegative);
  joint.following_timeout_s =
      table.number_or("following_timeout_s", joint.following_timeout_s, {0.0, 65.0});
}

/// [joint_defaults]: what every [[joint]] has that does not say otherwise.
JointConfig read_joint_defaults(TomlTable table) {
  JointConfig joint;
  joint.encoder_counts_per_rev = table.number_or("encoder_counts_per_rev", kUnset, kPositive);
  joint.motor_encoder_counts_per_rev =
      table.number_or("motor_encoder_counts_per_rev", kUnset, kPositive);
  joint.torque_noise_Nm = table.number_or("torque_noise_Nm", 0.0, kNotNegative);
  read_following(table, joint);
  joint.on_fault = read_stop_category(table, StopCategory::kCategory1);
  table.finish();
  return joint;
}

double number_or_default(TomlTable& table, std::string_view key, double value) {
  return std::isnan(value) ? table.number(key, kPositive) : table.number_or(key, value, kPositive);
}

void read_joint_limits(TomlTable& table, JointConfig& joint) {
  joint.min_position_rad = table.number_or("min_position_rad", kUnset);
  joint.max_position_rad = table.number_or("max_position_rad", kUnset);
  if (joint.min_position_rad >= joint.max_position_rad) {  // false where one is NaN
    table.error("min_position_rad", "the position limits are reversed or equal",
                "min_position_rad must be less than max_position_rad");
  }
  joint.max_velocity_rad_s = table.number_or("max_velocity_rad_s", kUnset, kPositive);
  joint.max_torque_Nm = table.number_or("max_torque_Nm", kUnset, kPositive);
  joint.rated_torque_Nm = table.number_or("rated_torque_Nm", kUnset, kPositive);
}

void check_seat(TomlTable& table, const JointConfig& joint, const RobotConfig& robot) {
  for (const JointConfig& other : robot.joints) {
    if (!joint.name.empty() && other.name == joint.name) {
      table.error("name",
                  other.board == joint.board
                      ? "the joint '" + joint.name + "' is described twice"
                      : "the joint '" + joint.name + "' is on two boards, '" + other.board +
                            "' and '" + joint.board + "'",
                  "remove one of the two");
    } else if (!joint.board.empty() && other.board == joint.board && other.axis == joint.axis) {
      table.error("axis",
                  "axis " + std::to_string(joint.axis) + " of board '" + joint.board +
                      "' already drives joint '" + other.name + "'",
                  "give each joint of a board an axis of its own");
    }
  }
  for (const auto& [locked, position] : robot.model.lock) {
    if (locked != joint.name) continue;
    table.error("name", "the joint '" + joint.name + "' is locked in [model.lock]",
                "remove the lock or the [[joint]]");
  }
}

void read_joint(TomlTable table, const JointConfig& defaults, RobotConfig& robot) {
  JointConfig joint = defaults;
  joint.line = table.line();
  joint.name = table.text("name");
  joint.board = table.text("board");
  check_reference(table, "board", joint.board, robot.boards, "board");
  joint.axis = static_cast<int>(table.integer_or("axis", 0, 0, 7));
  joint.actuator = table.text("actuator");
  check_reference(table, "actuator", joint.actuator, robot.actuators, "actuator");
  joint.gains = table.text("gains");
  check_reference(table, "gains", joint.gains, robot.gains, "gains table");
  read_joint_limits(table, joint);
  joint.encoder_counts_per_rev =
      number_or_default(table, "encoder_counts_per_rev", joint.encoder_counts_per_rev);
  joint.motor_encoder_counts_per_rev =
      number_or_default(table, "motor_encoder_counts_per_rev", joint.motor_encoder_counts_per_rev);
  joint.torque_noise_Nm = table.number_or("torque_noise_Nm", joint.torque_noise_Nm, kNotNegative);
  read_following(table, joint);
  joint.on_fault = read_stop_category(table, joint.on_fault);
  check_seat(table, joint, robot);
  table.finish();
  robot.joints.push_back(joint);
}

}  // namespace

std::string actuator_problem(const ActuatorConfig& a) {
  const bool electrical = a.order == 1 || a.order == 3;
  const bool mechanical = a.order >= 2;
  if (electrical && a.inductance_H <= 0.0) return "inductance_H must be positive";
  if (mechanical && a.inertia_kg_m2 <= 0.0) return "inertia_kg_m2 must be positive";
  if (mechanical && a.spring_Nm_rad <= 0.0) return "spring_Nm_rad must be positive";
  const double emf = a.gear_ratio * a.torque_constant_Nm_A;
  if (electrical && a.resistance_ohm > 0.0 && a.damping_Nms_rad < emf * emf / a.resistance_ohm) {
    return "damping_Nms_rad must include the back-EMF's share N^2 K^2 / R = " +
           std::to_string(emf * emf / a.resistance_ohm);
  }
  return {};
}

void read_drive_tables(TomlTable& root, RobotConfig& robot) {
  TomlTable actuators = root.table_or_empty("actuator");
  for (const std::string& name : actuators.table_names()) {
    read_actuator(actuators.table(name), name, robot);
  }
  actuators.finish();
  TomlTable gains = root.table_or_empty("gains");
  for (const std::string& name : gains.table_names()) read_gains(gains.table(name), name, robot);
  gains.finish();
}

void read_joints(TomlTable& root, RobotConfig& robot) {
  const JointConfig defaults = read_joint_defaults(root.table_or_empty("joint_defaults"));
  for (TomlTable& joint : root.tables("joint")) read_joint(joint, defaults, robot);
}

}  // namespace tandem::hal
