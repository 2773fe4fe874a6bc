// Turns robot.toml into hal::Robot: limits and gain bounds of every joint, from its actuator and
// gains.
#include "hal/config/capabilities.hpp"

#include <algorithm>
#include <cmath>

#include "base/quoting.hpp"
#include "canopen/drive_abilities.hpp"

namespace tandem::hal {
namespace {

using canopen::Mode;

bool any(const PidGains& gains) { return gains.kp != 0.0 || gains.ki != 0.0 || gains.kd != 0.0; }

struct DriveSheet {
  const canopen::DataSheet& sheet;
  int axis = 0;
};

/// A joint that is on no board yet is taken for one of ours.
DriveSheet sheet_of(const RobotConfig& robot, const JointConfig& joint) {
  const BoardConfig* board = robot.board(joint.board);
  static const auto own = canopen::tandem_board_sheet();
  return {board != nullptr ? *board->sheet : *own, board != nullptr ? joint.axis : 0};
}

canopen::DriveAbilities drive_of(const RobotConfig& robot, const JointConfig& joint) {
  const DriveSheet drive = sheet_of(robot, joint);
  return canopen::abilities_of(drive.sheet, drive.axis);
}

std::uint8_t bit(Capability capability, bool set) {
  return set ? static_cast<std::uint8_t>(capability) : std::uint8_t{0};
}

/// @param full  of the output over that of the input
PidGains most(double full, double kp, double ki, double kd) {
  return {.kp = kp * full, .ki = ki * full, .kd = kd * full};
}

std::array<PidGains, kPidLoops> most_gains(double torque, double voltage, double current) {
  const double volts_Nm = torque > 0.0 ? voltage / torque : 0.0;
  const double volts_A = current > 0.0 ? voltage / current : 0.0;
  return {most(torque, 1e4, 1e5, 1e2), most(torque, 1e2, 1e4, 1.0), most(volts_Nm, 1e2, 1e5, 1.0),
          most(volts_A, 1e2, 1e6, 1.0)};
}

/// Current and voltage, which no torque reference limits: by the torque that they drive.
void bound_direct_drive(const JointConfig& joint, const ActuatorConfig& motor,
                        JointCapabilities& out) {
  const double constant_Nm_A = motor.torque_per_A();
  const bool known = joint.max_torque_Nm > 0.0 && constant_Nm_A > 0.0;
  if (known) out.max_current_A = std::min(out.max_current_A, joint.max_torque_Nm / constant_Nm_A);
  out.max_current_rate_A_s = out.max_current_A / kFullScale_s;
  out.max_voltage_rate_V_s = out.max_voltage_V / kFullScale_s;
  if (!known) return;
  const double rate_A_s =
      joint.max_torque_rate_Nm_s.value_or(joint.max_torque_Nm / kFullScale_s) / constant_Nm_A;
  out.max_current_rate_A_s = std::min(out.max_current_rate_A_s, rate_A_s);
  if (motor.resistance_ohm > 0.0) {
    out.max_voltage_rate_V_s = std::min(out.max_voltage_rate_V_s, motor.resistance_ohm * rate_A_s);
  }
}

}  // namespace

Robot robot_of(const RobotConfig& config) {
  Robot robot{
      .name = config.name, .file = config.file, .floating_base = config.model.floating_base};
  for (const JointConfig& joint : config.joints) {
    robot.joints.push_back({capabilities_of(config, joint), joint.name});
  }
  for (const PassiveConfig& joint : config.passive) {
    robot.passive.push_back({joint.name, joint.position_rad});
  }
  robot.followers = config.followers;
  robot.loops = config.loop_specs();
  for (const SensorConfig& sensor : config.sensors) {
    robot.sensors.push_back({sensor.name, sensor.type, sensor.joint, sensor.link});
  }
  robot.sites.assign(config.model.sites.begin(), config.model.sites.end());
  robot.feet = config.contact.feet;
  robot.postures.assign(config.postures.begin(), config.postures.end());
  return robot;
}

JointCapabilities capabilities_of(const RobotConfig& robot, const JointConfig& joint) {
  const ActuatorConfig& actuator = robot.actuator_of(joint);
  const GainsConfig& gains = robot.gains_of(joint);
  JointCapabilities out;
  out.slides = joint.slides;
  out.min_position_rad = joint.min_position_rad;
  out.max_position_rad = joint.max_position_rad;
  out.max_velocity_rad_s = joint.max_velocity_rad_s;
  out.max_acceleration_rad_s2 = joint.max_acceleration_rad_s2;
  out.max_jerk_rad_s3 = joint.max_jerk_rad_s3;
  const canopen::DriveAbilities drive = drive_of(robot, joint);
  const bool told = drive.settings;  // the gains tables are what its loops have
  const bool torque = joint.max_torque_Nm > 0.0 &&
                      (!told || any(gains.torque.gains) || gains.torque_feedforward > 0.0);
  const bool current = actuator.current_limit_A > 0.0 && any(gains.current.gains);
  const auto loop = [&](const PidConfig& pid) { return torque && (!told || any(pid.gains)); };
  out.bits = static_cast<std::uint8_t>(
      bit(Capability::kPosition, drive.position != Mode::kNone && loop(gains.position)) |
      bit(Capability::kVelocity, drive.velocity != Mode::kNone && loop(gains.velocity)) |
      bit(Capability::kTorque, drive.torque != Mode::kNone && torque) |
      bit(Capability::kCompliant, drive.impedance && torque) |
      bit(Capability::kOpenLoop, drive.open_loop && actuator.voltage_limit_V > 0.0) |
      bit(Capability::kCurrent, drive.current && current));
  out.max_voltage_V = actuator.voltage_limit_V;
  out.max_current_A = actuator.current_limit_A;
  if (torque) {
    out.max_torque_Nm = joint.max_torque_Nm;
    out.max_torque_rate_Nm_s =
        joint.max_torque_rate_Nm_s.value_or(joint.max_torque_Nm / kFullScale_s);
    out.most_gains = most_gains(out.max_torque_Nm, out.max_voltage_V, out.max_current_A);
    out.stiffness_Nm_rad = gains.stiffness_Nm_rad;
    out.damping_Nms_rad = gains.damping_Nms_rad;
    out.max_stiffness_Nm_rad = std::max(gains.position.gains.kp, gains.stiffness_Nm_rad);
    const double critical = 2.0 * std::sqrt(out.max_stiffness_Nm_rad * actuator.inertia_kg_m2);
    out.max_damping_Nms_rad = std::max({critical, gains.position.gains.kd, gains.damping_Nms_rad});
  }
  bound_direct_drive(joint, actuator, out);
  return out;
}

std::vector<JointCapabilities> joint_capabilities(const RobotConfig& robot) {
  std::vector<JointCapabilities> out;
  for (const JointConfig& joint : robot.joints) out.push_back(capabilities_of(robot, joint));
  return out;
}

std::vector<MotorFeedback> motor_feedback(const RobotConfig& robot) {
  std::vector<MotorFeedback> out;
  for (const JointConfig& joint : robot.joints) {
    const DriveSheet drive = sheet_of(robot, joint);
    const auto tells = [&](std::uint16_t index,
                           canopen::DataType type = canopen::DataType::kInteger16) {
      return canopen::mappable(drive.sheet, canopen::of_axis(index, drive.axis), 0, type,
                               canopen::kMapTpdo);
    };
    out.push_back(
        {.position = tells(canopen::object::kMotorPosition, canopen::DataType::kInteger32),
         .torque = tells(canopen::object::kTorque),
         .current = tells(canopen::object::kCurrent),
         .voltage = tells(canopen::object::kVoltage),
         .temperature = tells(canopen::object::kTemperature)});
  }
  return out;
}

Status check_capability(const RobotConfig& robot, std::size_t joint, ControlMode mode,
                        InteractionMode interaction) {
  const JointConfig& config = robot.joints.at(joint);
  if (capabilities_of(robot, config).can(mode, interaction)) return {};
  const BoardConfig* board = robot.board(config.board);
  if (board != nullptr && !board->eds.empty()) {
    return std::unexpected(Error{
        .message = "joint '" + config.name + "' has no " + to_string(mode) + " control (" +
                   to_string(interaction) + "): its drive has no such mode",
        .hint = "`tandem eds show " + shell_word(board->eds) + "` lists its modes; ask for another",
        .file = robot.file,
        .line = board->line,
        .key = "board." + board->name});
  }
  Error error{.message = "joint '" + config.name + "' has no " + to_string(mode) + " control (" +
                         to_string(interaction) + ")",
              .hint = "give [gains." + config.gains + "] the loop, or ask for another mode",
              .file = robot.file,
              .line = robot.gains_of(config).line,
              .key = "gains." + config.gains};
  return std::unexpected(std::move(error));
}

ParameterImage initial_parameters(const RobotConfig& robot) {
  std::vector<PidGains> gains;
  for (const JointConfig& joint : robot.joints) {
    const GainsConfig& of = robot.gains_of(joint);
    gains.insert(gains.end(),
                 {of.position.gains, of.velocity.gains, of.torque.gains, of.current.gains});
  }
  return ParameterImage(std::move(gains));
}

}  // namespace tandem::hal
