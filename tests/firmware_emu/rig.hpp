// A board with small motors on springs, and a bare hand on its bus: frames written out byte by
// byte, independent of the drive master.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <numbers>
#include <vector>

#include "firmware_emu/board.hpp"
#include "rt/scoped_realtime.hpp"

namespace tandem::firmware::testing {

/// J th'' = N K i - Dm th' - Ks (th - q), i = (V - N K th') / R while the bridge is on;
/// the link either stands still or moves with inertia, friction and a load.
struct TestJoint {
  double R = 0.664, NK = 4.1, J = 0.1387, Dm = 0.2, Ks = 395.46;
  double link_inertia = 0.0;  ///< 0: the link stands still
  double link_friction = 0.5;
  double load_Nm = 0.0;
  double th = 0.0, w = 0.0, q = 0.0, v = 0.0, i = 0.0;
  double temperature_C = 25.0, bus_V = 40.0;

  [[nodiscard]] double torque() const { return Ks * (th - q); }
  void advance(const AxisDrive& drive, double dt_s) {
    constexpr int kSteps = 20;
    const double h = dt_s / kSteps;
    for (int k = 0; k < kSteps; ++k) {
      i = drive.enabled ? (drive.voltage_V - NK * w) / R : 0.0;
      w += h * (NK * i - Dm * w - torque()) / J;
      th += h * w;
      if (link_inertia > 0.0) {
        v += h * (torque() + load_Nm - link_friction * v) / link_inertia;
        q += h * v;
      }
    }
  }
  [[nodiscard]] AxisSense sense() const {
    return {.link_position_rad = q,
            .motor_position_rad = th,
            .spring_torque_Nm = torque(),
            .current_A = i,
            .temperature_C = temperature_C,
            .bus_voltage_V = bus_V};
  }
};

/// A soft leg joint of the humanoid, 1 kHz.
inline AxisSetup axis_setup() {
  AxisSetup axis;
  axis.parameters = {.rated_torque_Nm = 50.0,
                     .min_position_rad = -2.0,
                     .max_position_rad = 2.0,
                     .position = {.kp = 400.0, .ki = 400.0, .kd = 40.0},
                     .velocity = {.kp = 5.0, .ki = 20.0},
                     .torque = {.kp = 0.2, .ki = 2.0, .kd = 0.01},
                     .current = {.kp = 0.5, .ki = 200.0},
                     .torque_to_voltage_V_Nm = 0.664 / 4.1,
                     .emf_compensation_Vs_rad = 0.9 * 4.1,
                     .motor_feedback = 1.0,
                     .resistance_ohm = 0.664,
                     .motor_constant_Nm_A = 4.1,
                     .spring_Nm_rad = 395.46,
                     .stiffness_Nm_rad = 100.0,
                     .damping_Nms_rad = 5.0,
                     .voltage_limit_V = 40.0,
                     .current_limit_A = 50.0,
                     .torque_limit_Nm = 60.0,
                     .velocity_limit_rad_s = 8.0};
  return axis;
}

inline BoardSetup board_setup(std::size_t axes = 1) {
  BoardSetup setup;
  setup.node_id = 5;
  setup.serial = 0x12345678;
  setup.axes.assign(axes, axis_setup());
  return setup;
}

/// The command of one axis as RPDO 1 carries it.
struct Command {
  std::uint16_t controlword = 0;
  std::int8_t mode = 8;
  std::int32_t position = 0;
  std::int32_t velocity_offset = 0;
  std::int16_t torque_offset = 0;
};

inline void append(std::vector<std::uint8_t>& bytes, std::uint64_t value, int size) {
  for (int k = 0; k < size; ++k) bytes.push_back(static_cast<std::uint8_t>(value >> (8 * k)));
}

class Rig {
 public:
  explicit Rig(const BoardSetup& setup = board_setup())
      : board(setup),
        joints(setup.axes.size()),
        commands(setup.axes.size()),
        drives(setup.axes.size()),
        senses(setup.axes.size()),
        id(setup.node_id) {}

  void send(std::uint32_t cob, const std::vector<std::uint8_t>& bytes) {
    give(canopen::make_frame(cob, bytes));
  }
  /// Every call of the board is in the trap: an allocation, a lock or a system call is a failure.
  void give(const canopen::Frame& frame) {
    {
      const rt::ScopedRealtime cycle;
      board.receive(frame);
    }
    collect();
  }
  void nmt(std::uint8_t command) { send(0x000, {command, static_cast<std::uint8_t>(id)}); }

  /// Expedited download. @return abort code, 0 when done
  template <class T>
  std::uint32_t write(std::uint16_t index, std::uint8_t sub, T value) {
    std::uint8_t raw[8] = {};
    std::memcpy(raw, &value, sizeof value);
    constexpr int kSpecifier[] = {0, 0x2F, 0x2B, 0, 0x23};
    std::vector<std::uint8_t> bytes{static_cast<std::uint8_t>(kSpecifier[sizeof value])};
    append(bytes, index, 2);
    append(bytes, sub, 1);
    for (int k = 0; k < 4; ++k) bytes.push_back(raw[k]);
    const canopen::Frame answer = ask(bytes);
    if (answer.data[0] == 0x60) return 0;
    std::uint32_t code = 0;
    std::memcpy(&code, &answer.data[4], 4);
    return code;
  }
  template <class T>
  T read(std::uint16_t index, std::uint8_t sub) {
    std::vector<std::uint8_t> bytes{0x40};
    append(bytes, index, 2);
    append(bytes, sub, 5);
    const canopen::Frame answer = ask(bytes);
    T value{};
    EXPECT_EQ(answer.data[0] & 0xE3, 0x43) << std::hex << index;
    std::memcpy(&value, &answer.data[4], sizeof value);
    return value;
  }
  /// What the board holds, without the bus.
  template <class T>
  [[nodiscard]] T object(std::uint16_t index, std::uint8_t sub = 0) const {
    return board.dictionary().value<T>(index, sub);
  }

  /// Maps the PDOs of the wire: command, measurement; then NMT start.
  void start() {
    step();
    for (std::size_t a = 0; a < commands.size(); ++a) {
      const auto o = static_cast<std::uint32_t>(0x800 * a);
      append_mapping(rpdo_, {0x60400010 + (o << 16), 0x60600008 + (o << 16), 0x607A0020 + (o << 16),
                             0x60B10020 + (o << 16), 0x60B20010 + (o << 16)});
      append_mapping(tpdo_, {0x60410010 + (o << 16), 0x60640020 + (o << 16), 0x606C0020 + (o << 16),
                             0x60770010 + (o << 16), 0x20000020 + (o << 16)});
    }
    map(0x1400, 0x1600, 0x200 + static_cast<std::uint32_t>(id), rpdo_);
    map(0x1800, 0x1A00, 0x180 + static_cast<std::uint32_t>(id), tpdo_);
    nmt(1);
  }
  void map(std::uint16_t parameter, std::uint16_t mapping, std::uint32_t cob,
           const std::vector<std::uint32_t>& entries) {
    EXPECT_EQ(write(parameter, 1, 0x80000000U | cob), 0U);
    EXPECT_EQ(write(parameter, 2, std::uint8_t{1}), 0U);
    EXPECT_EQ(write(mapping, 0, std::uint8_t{0}), 0U);
    for (std::size_t k = 0; k < entries.size(); ++k) {
      EXPECT_EQ(write(mapping, static_cast<std::uint8_t>(k + 1), entries[k]), 0U);
    }
    EXPECT_EQ(write(mapping, 0, static_cast<std::uint8_t>(entries.size())), 0U);
    EXPECT_EQ(write(parameter, 1, cob), 0U);
  }

  /// One cycle of the master: SYNC, step, and the commands that take effect with the next SYNC.
  void cycle() {
    if (send_sync) send(0x080, {});
    step();
    if (!send_commands) return;
    std::vector<std::uint8_t> bytes;
    for (const Command& c : commands) {
      append(bytes, c.controlword, 2);
      append(bytes, static_cast<std::uint8_t>(c.mode), 1);
      append(bytes, static_cast<std::uint32_t>(c.position), 4);
      append(bytes, static_cast<std::uint32_t>(c.velocity_offset), 4);
      append(bytes, static_cast<std::uint16_t>(c.torque_offset), 2);
    }
    send(0x200 + static_cast<std::uint32_t>(id), bytes);
  }
  void cycles(int count) {
    for (int k = 0; k < count; ++k) cycle();
  }
  void step() {
    for (std::size_t a = 0; a < joints.size(); ++a) senses[a] = joints[a].sense();
    if (tamper) tamper(senses);
    {
      const rt::ScopedRealtime cycle;
      board.step(1'000'000, senses, drives);
    }
    for (std::size_t a = 0; a < joints.size(); ++a) joints[a].advance(drives[a], 1.0e-3);
    collect();
  }
  /// Walks the drive machine of every axis to Operation Enabled in `mode`, where it is.
  void enable(std::int8_t mode = 8) {
    for (std::size_t a = 0; a < commands.size(); ++a) {
      commands[a].mode = mode;
      commands[a].position = counts(joints[a].q);
    }
    for (const int word : {0x00, 0x06, 0x07, 0x0F}) {
      for (Command& c : commands) c.controlword = static_cast<std::uint16_t>(word);
      cycles(3);
    }
  }
  [[nodiscard]] std::uint16_t statusword(int axis = 0) const {
    return object<std::uint16_t>(static_cast<std::uint16_t>(0x6041 + 0x800 * axis));
  }
  [[nodiscard]] canopen::DriveMachineState state(int axis = 0) const {
    return canopen::drive_state(statusword(axis));
  }
  [[nodiscard]] std::uint16_t error(int axis = 0) const {
    return object<std::uint16_t>(static_cast<std::uint16_t>(0x603F + 0x800 * axis));
  }
  [[nodiscard]] static std::int32_t counts(double rad) {
    return static_cast<std::int32_t>(std::lround(rad * 524288.0 / (2.0 * std::numbers::pi)));
  }
  [[nodiscard]] std::vector<canopen::Frame> frames_of(std::uint32_t cob) const {
    std::vector<canopen::Frame> found;
    for (const canopen::Frame& frame : seen) {
      if (frame.id == cob) found.push_back(frame);
    }
    return found;
  }

  Board board;
  std::vector<TestJoint> joints;
  std::vector<Command> commands;
  std::vector<AxisDrive> drives;
  std::vector<AxisSense> senses;
  std::vector<canopen::Frame> seen;
  void (*tamper)(std::vector<AxisSense>&) = nullptr;  ///< falsifies what the sensors see
  bool send_sync = true;
  bool send_commands = true;

 private:
  static void append_mapping(std::vector<std::uint32_t>& to,
                             std::initializer_list<std::uint32_t> entries) {
    to.insert(to.end(), entries);
  }
  void collect() {
    for (const canopen::Frame& frame : board.outgoing()) seen.push_back(frame);
    board.clear_outgoing();
  }
  canopen::Frame ask(const std::vector<std::uint8_t>& bytes) {
    seen.clear();
    send(0x600 + static_cast<std::uint32_t>(id), bytes);
    const auto answers = frames_of(0x580 + static_cast<std::uint32_t>(id));
    EXPECT_EQ(answers.size(), 1U);
    return answers.empty() ? canopen::Frame{} : answers.front();
  }

  int id;
  std::vector<std::uint32_t> rpdo_;
  std::vector<std::uint32_t> tpdo_;
};

}  // namespace tandem::firmware::testing
