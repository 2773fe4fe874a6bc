// The smallest robot that has everything: three joints, each a mass on a motor, two sensors.
// Layer: tests.  Thread: any.
#pragma once

#include <algorithm>
#include <array>
#include <vector>

#include "base/archive.hpp"
#include "hal/backend.hpp"
#include "hal/config/robot_config.hpp"

namespace tandem::hal::test {

inline RobotConfig fake_robot() {
  RobotConfig robot;
  robot.file = "fake/robot.toml";
  robot.name = "fake";
  robot.actuators.push_back({.name = "motor",
                             .resistance_ohm = 1.0,
                             .inductance_H = 1e-3,
                             .torque_constant_Nm_A = 0.05,
                             .gear_ratio = 100.0,
                             .inertia_kg_m2 = 0.2,
                             .damping_Nms_rad = 25.0,
                             .spring_Nm_rad = 1000.0,
                             .spring_damping_Nms_rad = 1.0,
                             .current_limit_A = 10.0,
                             .voltage_limit_V = 24.0});
  robot.gains.push_back({.name = "arm",
                         .position = {{200.0, 0.0, 25.0}},
                         .velocity = {{40.0, 100.0, 0.0}},
                         .torque = {{0.2, 2.0, 0.0}},
                         .current = {{0.5, 200.0, 0.0}},
                         .stiffness_Nm_rad = 50.0,
                         .damping_Nms_rad = 15.0});
  for (const char* name : {"shoulder", "elbow", "wrist"}) {
    robot.joints.push_back({.name = name,
                            .board = "board",
                            .axis = static_cast<int>(robot.joints.size()),
                            .actuator = "motor",
                            .gains = "arm",
                            .min_position_rad = -1.5,
                            .max_position_rad = 1.5,
                            .max_velocity_rad_s = 2.0,
                            .max_torque_Nm = 20.0,
                            .rated_torque_Nm = {20.0}});
  }
  SensorConfig& hand = robot.sensors.emplace_back();
  hand.name = "hand";
  hand.joint = "wrist";
  SensorConfig& imu = robot.sensors.emplace_back();
  imu.name = "imu";
  imu.type = SensorType::kImu;
  return robot;
}

/// Every mode in its simplest form. It is not a model of anything: what the interfaces ask for
/// happens, within a few cycles.
class FakeBackend : public Backend {
 public:
  explicit FakeBackend(const RobotConfig& robot)
      : joints_(robot.joints.size()), command_(robot.shape()) {}

  Pace pace() const noexcept override { return Pace::kSimulatedClock; }
  Phase phase() const noexcept override {
    if (cycles_ < kBringUpCycles) return Phase::kBringUp;
    if (latched_ != StopCategory::kWarn) return Phase::kFault;
    for (const DrivenJoint& joint : joints_) {
      if (joint.fault != 0) return Phase::kFault;
    }
    return Phase::kOperational;
  }
  std::string status_text() const override { return "fake"; }

  Code read(const CycleTime& time, StateImage& state) noexcept override {
    ++cycles_;
    state.cycle()[0] = time.cycle;
    state.time_ns()[0] = time.time_ns;
    const double dt = static_cast<double>(time.period_ns) * 1e-9;
    for (std::size_t j = 0; j < joints_.size(); ++j) {
      step(j, dt);
      publish(j, state);
    }
    const double load = joints_.back().torque;
    std::ranges::copy(std::array<double, 6>{load, 0.0, 9.81, 0.0, 0.0, load},
                      state.sensor_values(0).begin());
    std::ranges::copy(std::array<double, 10>{0, 0, 0, 1, 0, 0, joints_[0].velocity, 0, 0, 9.81},
                      state.sensor_values(1).begin());
    return Code::kOk;
  }
  Code write(const CommandImage& command, const ParameterImage& parameters) noexcept override {
    command_.assign(command);
    for (std::size_t j = 0; j < joints_.size(); ++j) {
      for (std::size_t k = 0; k < kPidLoops; ++k) {
        joints_[j].gains[k] = parameters.gains(j, static_cast<PidLoop>(k));
      }
    }
    return Code::kOk;
  }
  void stop(StopCategory category) noexcept override { latched_ = std::min(latched_, category); }
  void reset() noexcept override {
    latched_ = StopCategory::kWarn;
    for (DrivenJoint& joint : joints_) joint.fault = 0;
  }
  bool shut_down() noexcept override { return true; }
  bool archive(Archive& ar) override {
    ar(joints_, command_, cycles_, latched_);
    return ar.ok();
  }

  void provoke_fault(std::size_t j) { joints_[j].fault = 0x8611; }

 private:
  static constexpr std::int64_t kBringUpCycles = 5;
  struct DrivenJoint {
    double position = 0.1, velocity = 0.0, acceleration = 0.0, torque = 0.0;
    double current = 0.0, voltage = 0.0, integral = 0.0, reference = 0.0;
    PidGains gains[kPidLoops];
    std::int64_t mode = 0, interaction = 0, fault = 0, enabled = 0;
  };
  static constexpr double kTorquePerCurrent = 5.0, kFriction = 1.0;

  static double pid(DrivenJoint& joint, PidLoop loop, double error, double rate, double dt) {
    const PidGains& gains = joint.gains[static_cast<std::size_t>(loop)];
    joint.integral += error * dt;
    return gains.kp * error + gains.ki * joint.integral - gains.kd * rate;
  }

  /// The torque that the joint's mode asks for.
  double wanted(DrivenJoint& joint, std::size_t j, double dt) {
    const double error = command_.position_rad()[j] - joint.position;
    const double slip = command_.velocity_rad_s()[j] - joint.velocity;
    const double forward = command_.torque_Nm()[j];
    const double K = command_.stiffness_Nm_rad()[j];
    const double D = command_.damping_Nms_rad()[j];
    switch (static_cast<ControlMode>(joint.mode)) {
      case ControlMode::kPosition:
        if (joint.interaction != 0) return K * error - D * joint.velocity + forward;
        return pid(joint, PidLoop::kPosition, error, joint.velocity, dt) + forward;
      case ControlMode::kVelocity:
        joint.reference += command_.velocity_rad_s()[j] * dt;
        if (joint.interaction != 0) {
          return K * (joint.reference - joint.position) + D * slip + forward;
        }
        return pid(joint, PidLoop::kVelocity, slip, 0.0, dt) + forward;
      case ControlMode::kTorque: return forward;
      default: return 0.0;
    }
  }

  void follow_mode(DrivenJoint& joint, std::size_t j) {
    if (command_.fault_reset()[j] != 0) joint.fault = 0;
    const bool changed = joint.mode != command_.mode()[j] ||
                         joint.interaction != command_.interaction()[j] || joint.enabled == 0;
    joint.mode = command_.mode()[j];
    joint.interaction = command_.interaction()[j];
    const bool torque = latched_ >= StopCategory::kHold;
    joint.enabled = torque && cycles_ >= kBringUpCycles && joint.fault == 0 && joint.mode != 0;
    if (changed) {
      joint.reference = joint.position;
      joint.integral = 0.0;
    }
  }

  void step(std::size_t j, double dt) {
    DrivenJoint& joint = joints_[j];
    follow_mode(joint, j);
    const double emf = kTorquePerCurrent * joint.velocity;
    const double share = std::min(0.9, joint.gains[2].kp);  // how fast the torque follows
    if (joint.enabled == 0) {
      joint.torque = 0.0;
    } else if (joint.mode == static_cast<int>(ControlMode::kOpenLoop)) {
      joint.torque = kTorquePerCurrent * (command_.voltage_V()[j] - emf);
    } else if (joint.mode == static_cast<int>(ControlMode::kCurrent)) {
      joint.torque += std::min(0.9, joint.gains[3].kp) *
                      (kTorquePerCurrent * command_.current_A()[j] - joint.torque);
    } else {
      joint.torque += share * (wanted(joint, j, dt) - joint.torque);
    }
    joint.current = joint.torque / kTorquePerCurrent;
    joint.voltage = joint.enabled == 0 ? 0.0 : joint.current + emf;
    joint.acceleration = joint.torque - kFriction * joint.velocity;
    joint.velocity += joint.acceleration * dt;
    joint.position += joint.velocity * dt;
  }

  void publish(std::size_t j, StateImage& state) const {
    const DrivenJoint& joint = joints_[j];
    state.position_rad()[j] = joint.position;
    state.velocity_rad_s()[j] = joint.velocity;
    state.acceleration_rad_s2()[j] = joint.acceleration;
    state.torque_Nm()[j] = joint.torque;
    state.motor_position_rad()[j] = joint.position + joint.torque / 1000.0;
    state.motor_velocity_rad_s()[j] = joint.velocity;
    state.current_A()[j] = joint.current;
    state.voltage_V()[j] = joint.voltage;
    state.temperature_C()[j] = 25.0;
    state.fault()[j] = static_cast<std::uint32_t>(joint.fault);
    state.mode()[j] = static_cast<std::int8_t>(joint.mode);
    state.interaction()[j] = static_cast<std::uint8_t>(joint.interaction);
    const DriveState drive = joint.fault != 0     ? DriveState::kFault
                             : joint.enabled != 0 ? DriveState::kOperationEnabled
                                                  : DriveState::kSwitchOnDisabled;
    state.drive_state()[j] = static_cast<std::uint8_t>(drive);
  }

  std::vector<DrivenJoint> joints_;
  CommandImage command_;
  std::int64_t cycles_ = 0;
  StopCategory latched_ = StopCategory::kWarn;
};

}  // namespace tandem::hal::test
