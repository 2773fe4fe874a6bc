#include "hal/config/drive_parameters.hpp"

#include "canopen/bytes.hpp"
#include "canopen/drive_abilities.hpp"

namespace tandem::hal {
namespace {

canopen::LoopGains loop_gains(const PidConfig& pid, double own_limit) {
  return {.kp = pid.gains.kp,
          .ki = pid.gains.ki,
          .kd = pid.gains.kd,
          .output_limit = pid.output_limit > 0.0 ? pid.output_limit : own_limit};
}

void set_scales(const JointConfig& joint, bool whole, canopen::DriveParameters& p) {
  p.link_counts_per_rev = joint.encoder_counts_per_rev;
  p.motor_counts_per_rev = joint.motor_encoder_counts_per_rev;
  p.rated_torque_Nm = joint.rated_torque_Nm;
  if (!whole) return;
  for (double* counts : {&p.link_counts_per_rev, &p.motor_counts_per_rev}) {
    *counts = canopen::clamp_round<std::uint32_t>(*counts);
  }
  p.max_torque_Nm = joint.max_torque_Nm;
}

void set_motor(const ActuatorConfig& motor, const GainsConfig& gains, canopen::DriveParameters& p) {
  const double per_A = motor.torque_per_A();
  p.torque_to_voltage_V_Nm =
      gains.torque_feedforward * (per_A > 0.0 ? motor.resistance_ohm / per_A : 0.0);
  p.emf_compensation_Vs_rad = gains.emf_compensation * per_A;
  p.resistance_ohm = motor.resistance_ohm;
  p.motor_constant_Nm_A = per_A;
  p.spring_Nm_rad = motor.order >= 2 ? motor.spring_Nm_rad : 0.0;
  p.voltage_limit_V = motor.voltage_limit_V;
  p.current_limit_A = motor.current_limit_A;
  p.continuous_current_A = motor.continuous_current_A;
  p.thermal_time_s = motor.thermal_time_s;
  p.temperature_limit_C = motor.temperature_limit_C;
}

}  // namespace

canopen::DriveParameters drive_parameters(const RobotConfig& robot, const JointConfig& joint) {
  const ActuatorConfig& motor = robot.actuator_of(joint);
  const GainsConfig& gains = robot.gains_of(joint);
  const BoardConfig* board = robot.board(joint.board);
  const bool ours = board == nullptr || canopen::abilities_of(*board->sheet, joint.axis).settings;
  canopen::DriveParameters p = joint.drive;
  set_scales(joint, ours, p);
  set_motor(motor, gains, p);
  p.torque_slope_Nm_s = torque_rate_Nm_s(joint);
  p.min_position_rad = joint.min_position_rad;
  p.max_position_rad = joint.max_position_rad;
  p.position = loop_gains(gains.position, joint.max_torque_Nm);
  p.velocity = loop_gains(gains.velocity, joint.max_torque_Nm);
  p.torque = loop_gains(gains.torque, motor.voltage_limit_V);
  p.current = loop_gains(gains.current, motor.voltage_limit_V);
  p.motor_feedback = gains.position_feedback == PositionFeedback::kMotor ? 1.0 : 0.0;
  p.stiffness_Nm_rad = gains.stiffness_Nm_rad;
  p.damping_Nms_rad = gains.damping_Nms_rad;
  p.torque_limit_Nm = joint.max_torque_Nm;
  p.velocity_limit_rad_s = joint.max_velocity_rad_s;
  p.following_window_rad = joint.following_error_rad;
  p.following_timeout_s = joint.following_timeout_s;
  p.oscillation_limit_Nm = oscillation_limit_Nm(joint, motor);
  p.oscillation_time_s = joint.oscillation_time_s;
  p.excess_share = joint.max_excess;
  p.excess_time_s = joint.excess_time_s;
  p.swing_limit_rad_s = joint.max_swing * joint.max_velocity_rad_s;
  if (joint.brake) {
    p.brake_fitted = 1.0;
    p.brake_release_ms = joint.brake->release_ms;
    p.brake_engage_ms = joint.brake->engage_ms;
  }
  // A drive of another make stops when it is told to, or when the master is not heard any more.
  p.command_timeout_syncs = ours && board != nullptr ? board->command_timeout_cycles : 0;
  return p;
}

}  // namespace tandem::hal
