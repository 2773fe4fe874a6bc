// A small robot's configuration, emulated boards on loopback buses, and the drive master.
#pragma once

#include <gtest/gtest.h>

#include <array>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "base/archive.hpp"
#include "firmware_emu/board.hpp"
#include "firmware_emu/sensor_board.hpp"
#include "hal/config/capabilities.hpp"
#include "hal/ethercat-can/drive_master.hpp"
#include "hal/ethercat-can/loopback.hpp"
#include "rt/scoped_realtime.hpp"

namespace tandem::hal::can::test {

inline constexpr double kPi = 3.14159265358979323846;

/// Three boards of two axes on one bus, a force/torque sensor on another.
/// 36000 counts per revolution (100 a degree), 50 Nm rated.
inline RobotConfig robot_config() {
  RobotConfig robot;
  robot.name = "rig";
  robot.actuators.push_back({.name = "motor",
                             .resistance_ohm = 0.5,
                             .torque_constant_Nm_A = 0.04,
                             .gear_ratio = 100.0,
                             .inertia_kg_m2 = 0.1,
                             .damping_Nms_rad = 33.0,
                             .spring_Nm_rad = 400.0,
                             .spring_damping_Nms_rad = 0.2,
                             .current_limit_A = 50.0,
                             .voltage_limit_V = 40.0});
  GainsConfig gains;
  gains.name = "gains";
  gains.position.gains = {.kp = 400.0, .ki = 10.0, .kd = 40.0};
  gains.torque.gains = {.kp = 0.2, .ki = 2.0, .kd = 0.0};
  gains.stiffness_Nm_rad = 100.0;
  gains.damping_Nms_rad = 5.0;
  robot.gains.push_back(gains);
  robot.buses.push_back({.name = "legs", .interface = "can0"});
  robot.buses.push_back({.name = "arms", .interface = "can1"});
  for (int b = 0; b < 3; ++b) {
    BoardConfig board;
    board.name = "board_" + std::to_string(b);
    board.bus = "legs";
    board.node_id = 10 + b;
    board.slow_pdo_every = 4;
    robot.boards.push_back(board);
    for (int a = 0; a < 2; ++a) {
      JointConfig joint;
      joint.name = "Joint" + std::to_string(2 * b + a);
      joint.board = board.name;
      joint.axis = a;
      joint.actuator = "motor";
      joint.gains = "gains";
      joint.min_position_rad = -2.0;
      joint.max_position_rad = 2.0;
      joint.max_velocity_rad_s = 10.0;
      joint.max_torque_Nm = 100.0;
      joint.rated_torque_Nm = 50.0;
      joint.encoder_counts_per_rev = 36000.0;
      joint.motor_encoder_counts_per_rev = 360000.0;
      robot.joints.push_back(joint);
    }
  }
  SensorConfig foot;
  foot.name = "foot";
  foot.bus = "arms";
  foot.node_id = 40;
  foot.joint = "Joint5";
  foot.link = "sole";
  robot.sensors.push_back(foot);
  return robot;
}

/// The same on classic CAN: three boards of one axis.
inline RobotConfig classic_config() {
  RobotConfig robot = robot_config();
  for (BusConfig& bus : robot.buses) bus.fd = false;
  robot.joints.resize(3);
  for (std::size_t j = 0; j < robot.joints.size(); ++j) {
    robot.joints[j].board = robot.boards[j].name;
    robot.joints[j].axis = 0;
  }
  robot.sensors[0].joint = "Joint2";
  return robot;
}

inline firmware::BoardSetup board_setup(const RobotConfig& robot, std::size_t b) {
  firmware::BoardSetup setup;
  setup.node_id = robot.boards[b].node_id;
  setup.name = robot.boards[b].name;
  firmware::AxisSetup axis;  // everything else comes by SDO
  axis.parameters.voltage_limit_V = 40.0;
  axis.parameters.current_limit_A = 50.0;
  axis.parameters.torque_limit_Nm = 100.0;
  setup.axes.assign(robot.joints.size() / robot.boards.size(), axis);
  return setup;
}

inline firmware::SensorSetup sensor_setup() {
  firmware::SensorSetup setup;
  setup.node_id = 40;
  setup.name = "foot";
  return setup;
}

/// One cycle as the in-process robot does it. The joints stand where `position_rad` says.
/// The master's and the boards' part of it must neither allocate nor lock: every test proves it.
class Rig {
 public:
  using Change = std::function<void(firmware::BoardSetup&, std::size_t)>;

  explicit Rig(RobotConfig config = robot_config(), const Change& change = {})
      : robot(std::move(config)),
        state(robot.shape()),
        command(robot.shape()),
        parameters(initial_parameters(robot)),
        position_rad(robot.joints.size(), 0.0) {
    for (std::size_t b = 0; b < robot.boards.size(); ++b) {
      firmware::BoardSetup setup = board_setup(robot, b);
      if (change) change(setup, b);
      boards.push_back(std::make_unique<firmware::Board>(setup));
    }
    present.assign(boards.size(), true);
    const std::array<Bus*, 2> ends{&legs.master(), &arms.master()};
    auto created = DriveMaster::create(robot, ends);
    EXPECT_TRUE(created) << created.error().to_string();
    master = std::move(*created);
    for (std::size_t j = 0; j < robot.joints.size(); ++j) {
      command.stiffness_Nm_rad()[j] = 100.0;
      command.damping_Nms_rad()[j] = 5.0;
      command.mode()[j] = static_cast<std::int8_t>(ControlMode::kPosition);
    }
  }

  /// SYNC, boards, receive.
  Code read() {
    time = {.cycle = cycle, .time_ns = static_cast<std::int64_t>(cycle) * 1'000'000};
    ++cycle;
    const rt::ScopedRealtime in_cycle;
    master->cycle_begin(time);
    run_boards();
    return master->receive(state);
  }
  Code write() {
    const rt::ScopedRealtime in_cycle;
    return master->send(command, parameters);
  }
  bool shut_down() {
    const rt::ScopedRealtime in_cycle;
    return master->shut_down();
  }
  Code step() {
    const Code code = read();
    (void)write();
    return code;
  }
  void steps(int count) {
    for (int i = 0; i < count; ++i) (void)step();
  }
  /// Steps until the phase is left, at most `most` cycles. @return cycles taken
  int leave(Phase phase, int most = 5000) {
    int taken = 0;
    while (taken < most && master->phase() == phase) {
      (void)step();
      ++taken;
    }
    return taken;
  }
  void bring_up() {
    leave(Phase::kBringUp);
    ASSERT_EQ(master->phase(), Phase::kOperational) << master->status_text();
    for (std::size_t j = 0; j < command.joints(); ++j) {
      command.position_rad()[j] = state.position_rad()[j];
    }
    steps(5);
  }
  /// What a joint's drive has, whatever the bus says.
  template <class T>
  [[nodiscard]] T object(std::size_t joint, std::uint16_t index, std::uint8_t sub = 0) const {
    const int axis = static_cast<int>(joint % axes());
    return boards[joint / axes()]->dictionary().value<T>(canopen::of_axis(index, axis), sub);
  }
  [[nodiscard]] std::array<float, 4> gains(std::size_t joint, std::uint16_t index) const {
    return {object<float>(joint, index, 1), object<float>(joint, index, 2),
            object<float>(joint, index, 3), object<float>(joint, index, 4)};
  }
  [[nodiscard]] const firmware::Axis& axis(std::size_t joint) const {
    return boards[joint / axes()]->axis(joint % axes());
  }
  [[nodiscard]] std::size_t axes() const { return boards[0]->axes(); }
  void archive(Archive& ar) {
    ar(*master, legs, arms, sensor, cycle);
    for (auto& board : boards) ar(*board);
    state.archive(ar);
    command.archive(ar);
  }

  RobotConfig robot;
  LoopbackBus legs;
  LoopbackBus arms;
  std::vector<std::unique_ptr<firmware::Board>> boards;
  std::vector<bool> present;  ///< false: the board has no power
  firmware::SensorBoard sensor{sensor_setup()};
  std::array<double, 6> wrench{1.0, 2.0, 300.0, -4.0, 5.5, -6.25};
  bool sensor_present = true;
  std::unique_ptr<DriveMaster> master;
  StateImage state;
  CommandImage command;
  ParameterImage parameters;
  std::vector<double> position_rad;
  double bus_V = 40.0;
  CycleTime time;
  std::uint64_t cycle = 0;

 private:
  void run_boards() {
    for (std::size_t b = 0; b < boards.size(); ++b) {
      if (!present[b]) continue;
      firmware::Board& board = *boards[b];
      for (const canopen::Frame& frame : legs.to_boards()) board.receive(frame);
      std::array<firmware::AxisSense, 2> sense;
      std::array<firmware::AxisDrive, 2> drive;
      for (std::size_t a = 0; a < axes(); ++a) {
        const double q = position_rad[axes() * b + a];
        sense[a] = {.link_position_rad = q, .motor_position_rad = q, .bus_voltage_V = bus_V};
      }
      board.step(1'000'000, std::span(sense).first(axes()), std::span(drive).first(axes()));
      (void)legs.boards().send(board.outgoing());
      board.clear_outgoing();
    }
    legs.take_to_boards(legs.to_boards().size());
    if (sensor_present) {
      for (const canopen::Frame& frame : arms.to_boards()) sensor.receive(frame);
      sensor.step(1'000'000, wrench);
      (void)arms.boards().send(sensor.outgoing());
      sensor.clear_outgoing();
    }
    arms.take_to_boards(arms.to_boards().size());
  }
};

}  // namespace tandem::hal::can::test
