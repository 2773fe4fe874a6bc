// [[joint]]: limits, brake, encoders and reaction to faults, for one joint or for a list of them.
#include <array>
#include <cmath>

#include "canopen/drive_abilities.hpp"
#include "hal/config/robot_config_read.hpp"

namespace tandem::hal {
namespace {

std::optional<HomingConfig> read_homing(TomlTable& table) {
  if (!table.has("homing")) return {};
  TomlTable homing = table.table("homing");
  HomingConfig h;
  h.line = table.line("homing");
  h.zero_speed_rad_s = kUnset;
  read_keys(homing, keys::kHoming, h);
  if (h.method == 0 && !homing.has_errors()) {
    homing.error("method", "0 is no homing", "give the number of a method that the drive has");
  }
  if (std::isnan(h.zero_speed_rad_s)) h.zero_speed_rad_s = 0.1 * h.speed_rad_s;
  if (h.at_start && !h.required) {
    homing.error("at_start", "goes with required = true", "remove one of the two");
  }
  if (const auto& at = h.home_switch_rad; at && !((*at)[0] < (*at)[1])) {
    if (!homing.has_errors()) {
      homing.error("home_switch_rad", "is no range", "give the lower angle first: [0.1, 0.2]");
    }
    h.home_switch_rad.reset();
  }
  homing.finish();
  return h;
}

/// What joints may have in common.
JointConfig read_joint(TomlTable& table, const RobotConfig& robot) {
  JointConfig joint;
  read_keys(table, keys::kJoint, joint);
  read_keys(table, keys::kDrive, joint.drive);
  check_reference(table, "actuator", joint.actuator, robot.actuators, "actuator");
  const auto motor = std::ranges::find(robot.actuators, joint.actuator, &ActuatorConfig::name);
  if (motor != robot.actuators.end()) joint.drive.temperature_limit_C = motor->temperature_limit_C;
  if (!table.has("gains")) joint.gains = joint.actuator;
  if (table.has("max_jerk_rad_s3") && !table.has("max_acceleration_rad_s2")) {
    table.error("max_jerk_rad_s3", "needs a max_acceleration_rad_s2",
                "give both, or the acceleration alone");
  }
  if (table.has("brake")) read_whole(table.table("brake"), keys::kBrake, joint.brake.emplace());
  joint.homing = read_homing(table);
  read_whole(table.table_or_empty("stop_options"), keys::kStopOptions, joint.stop_options);
  return joint;
}

void check_gains(TomlTable& table, const JointConfig& joint, const RobotConfig& robot) {
  if (table.has("gains")) {
    check_reference(table, "gains", joint.gains, robot.gains, "gains table");
  } else if (std::ranges::find(robot.actuators, joint.actuator, &ActuatorConfig::name) !=
                 robot.actuators.end() &&
             std::ranges::find(robot.gains, joint.gains, &GainsConfig::name) == robot.gains.end()) {
    table.error("gains", "there is no [gains." + joint.gains + "] for the actuator of that name",
                "add that table, or set gains");
  }
}

/// The joints that a table is for: `name`, or `names`.
std::vector<std::string> read_names(TomlTable& table) {
  if (!table.has("names")) return {table.text("name")};
  if (!table.text_or("name", {}).empty()) {
    table.error("names", "a joint's table has a name or names, not both", "remove one of the two");
  }
  std::vector<std::string> names = table.texts_or("names", {});
  if (names.empty() && !table.has_errors()) {
    table.error("names", "names no joint", "give at least one");
  }
  if (std::ranges::count(names, std::string()) != 0) table.error("names", "must not be empty");
  return names;
}

/// Its board and axis: where a board lists it, or as its table says.
void read_axis(TomlTable& table, std::span<const AxisAssignment> listed, const RobotConfig& robot,
               JointConfig& joint, std::vector<JointReference>& loose) {
  const auto found = std::ranges::find(listed, joint.name, &AxisAssignment::joint);
  if (found != listed.end()) {
    joint.board = found->board;
    joint.axis = found->axis;
    for (const char* key : {"board", "axis"}) {
      if (!table.has(key)) continue;
      table.error(key, "board '" + found->board + "' lists joint '" + joint.name + "' already",
                  "remove this key");
    }
  } else if (table.has("names")) {
    joint.board.clear();
    loose.push_back(
        {joint.name, table.error_at("names", "no board lists joint '" + joint.name + "'",
                                    "add it to the joints of its board")});
  } else {
    if (!table.has("board")) {
      table.error("board", "this key is missing",
                  "add it to the table, or the joint to the joints of its board");
    }
    check_reference(table, "board", joint.board, robot.boards, "board");
  }
}

/// Whether its drive can do the joint's homing.
void check_homing(TomlTable& table, const RobotConfig& robot, const JointConfig& joint) {
  const BoardConfig* board = robot.board(joint.board);
  if (!joint.homing || board == nullptr) return;
  const canopen::DataSheet& sheet = *board->sheet;
  if (!canopen::abilities_of(sheet, joint.axis).homing) {
    table.error("homing",
                "the drive of joint '" + joint.name +
                    "' cannot be homed by a master: " + board->eds +
                    " has no mode 6, its method (6098) cannot be written, or its "
                    "mode (6060) is in no PDO",
                "remove this key, and home the drive by its own program");
    return;
  }
  const std::vector<int> methods = canopen::homing_methods(sheet, joint.axis);
  if (!methods.empty() && std::ranges::find(methods, joint.homing->method) == methods.end()) {
    std::string list;
    for (const int method : methods) list += (list.empty() ? "" : ", ") + std::to_string(method);
    table.error("homing",
                "the drive of joint '" + joint.name + "' has no method " +
                    std::to_string(joint.homing->method) + ": 60E3 of " + board->eds + " lists " +
                    list,
                "give one of these");
    return;
  }
  if (canopen::writable(sheet, canopen::of_axis(canopen::object::kHomeOffset, joint.axis), 0)) {
    return;
  }
  const double counts = joint.homing->position_rad * joint.encoder_counts_per_rev;
  if (joint.zero_counts == 0 && std::abs(counts) < 1.0) return;
  table.error("homing",
              "the drive of joint '" + joint.name +
                  "' counts from 0 where it is homed: it has no home offset (607C)",
              "leave position_rad and zero_counts at 0, or home it by its own program");
}

void check_stop_options(TomlTable& table, const RobotConfig& robot, const JointConfig& joint) {
  const BoardConfig* board = robot.board(joint.board);
  if (board == nullptr) return;
  using namespace canopen::object;
  const StopOptions& options = joint.stop_options;
  for (const auto& [key, value, index] : {std::tuple{"shutdown", options.shutdown, kShutdownOption},
                                          {"disable", options.disable, kDisableOption},
                                          {"halt", options.halt, kHaltOption},
                                          {"fault", options.fault, kFaultReactionOption}}) {
    if (!value) continue;
    if (canopen::writable(*board->sheet, canopen::of_axis(index, joint.axis), 0)) continue;
    table.error("stop_options",
                std::string(key) + ": the drive of joint '" + joint.name +
                    "' has no such option (" + hex(index).substr(6) + ")",
                "remove it: the drive stops as it was commissioned");
  }
}

void check_joint(TomlTable& table, const JointConfig& joint, const RobotConfig& robot) {
  const char* key = table.has("names") ? "names" : "name";
  for (const JointConfig& other : robot.joints) {
    if (!joint.name.empty() && other.name == joint.name) {
      table.error(key,
                  other.board == joint.board
                      ? "the joint '" + joint.name + "' is described twice"
                      : "the joint '" + joint.name + "' is on two boards, '" + other.board +
                            "' and '" + joint.board + "'",
                  "remove one of the two");
    } else if (std::ranges::count(robot.boards, joint.board, &BoardConfig::name) == 1 &&
               other.board == joint.board && other.axis == joint.axis) {
      table.error("axis",
                  "axis " + std::to_string(joint.axis) + " of board '" + joint.board +
                      "' already drives joint '" + other.name + "'",
                  "give each joint of a board an axis of its own");
    }
  }
  check_not_locked(table, key, joint.name, robot);
}

void add_joints(TomlTable& table, std::span<const AxisAssignment> listed, RobotConfig& robot,
                std::vector<JointReference>& loose) {
  JointConfig common = read_joint(table, robot);
  common.line = table.line();
  check_gains(table, common, robot);
  if (common.min_position_rad >= common.max_position_rad) {  // false where one is NaN
    table.error("min_position_rad", "the position limits are reversed or equal",
                "min_position_rad must be less than max_position_rad");
  }
  for (const std::string& name : read_names(table)) {
    JointConfig joint = common;
    joint.name = name;
    read_axis(table, listed, robot, joint, loose);
    complete_units(table, robot, joint);
    check_homing(table, robot, joint);
    check_stop_options(table, robot, joint);
    check_joint(table, joint, robot);
    robot.joints.push_back(joint);
  }
  table.finish();
}

}  // namespace

void read_joints(TomlTable& root, std::span<const AxisAssignment> listed, RobotConfig& robot,
                 std::vector<JointReference>& loose) {
  const TomlTable defaults = read_defaults(
      root, "joint_defaults", [&](TomlTable& table) { return read_joint(table, robot); });
  for (TomlTable& joint : root.tables("joint")) {
    joint.inherit(defaults);
    add_joints(joint, listed, robot, loose);
  }
  std::ranges::stable_sort(robot.joints, {}, [&](const JointConfig& joint) {
    return std::ranges::find(listed, joint.name, &AxisAssignment::joint) - listed.begin();
  });
}

}  // namespace tandem::hal
