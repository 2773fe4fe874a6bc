// A data sheet entry by entry, and one joint on a drive that does what such a sheet says.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <memory>
#include <optional>
#include <string>

#include "rig.hpp"
#include "sheet_drive.hpp"

namespace tandem::hal::can::test {

using canopen::DataType;
using enum canopen::DataType;

/// A sheet, entry by entry.
struct Sheet {
  DataSheet sheet;

  Sheet& add(int index, int sub, DataType type, int access, std::optional<std::int64_t> value = {},
             bool plus_id = false) {
    SheetEntry entry{.index = static_cast<std::uint16_t>(index),
                     .sub = static_cast<std::uint8_t>(sub),
                     .type = static_cast<std::uint16_t>(type),
                     .access = static_cast<std::uint8_t>(access)};
    if (value) entry.value = canopen::SheetValue{.number = *value, .plus_node_id = plus_id};
    std::erase_if(sheet.entries, [&](const SheetEntry& e) {
      return e.index == entry.index && e.sub == entry.sub;
    });
    sheet.entries.push_back(std::move(entry));
    std::ranges::sort(sheet.entries, {}, [](const SheetEntry& e) { return e.index << 8 | e.sub; });
    return *this;
  }
  Sheet& remove(int index) {
    std::erase_if(sheet.entries, [&](const SheetEntry& e) { return e.index == index; });
    return *this;
  }
};

inline constexpr int kDemand = canopen::kWriteRpdo;
inline constexpr int kActual = canopen::kReadTpdo;
inline constexpr int kSetting = canopen::kReadWrite;

/// What nearly every drive has: four PDOs of eight entries each way, all in use from power-on.
inline Sheet common(int pdos = 4) {
  Sheet s;
  s.sheet.file = "drive.eds";
  s.sheet.vendor = 0x99;
  s.sheet.product = 0x123;
  s.add(0x1000, 0, kUnsigned32, canopen::kRead, 0x00060192);
  s.add(0x1017, 0, kUnsigned16, kSetting, 0);
  s.add(0x1018, 1, kUnsigned32, canopen::kRead, 0x99);
  s.add(0x1018, 2, kUnsigned32, canopen::kRead, 0x123);
  for (int n = 0; n < pdos; ++n) {
    s.add(0x1400 + n, 1, kUnsigned32, kSetting, 0x200 + 0x100 * n, true);
    s.add(0x1400 + n, 2, kUnsigned8, kSetting, 255);
    s.add(0x1800 + n, 1, kUnsigned32, kSetting, 0x180 + 0x100 * n, true);
    s.add(0x1800 + n, 2, kUnsigned8, kSetting, 255);
    s.add(0x1800 + n, 3, kUnsigned16, kSetting, 300);
    s.add(0x1800 + n, 5, kUnsigned16, kSetting, 0);
    for (const int map : {0x1600, 0x1A00}) {
      s.add(map + n, 0, kUnsigned8, kSetting, 0);
      for (int sub = 1; sub <= 8; ++sub) s.add(map + n, sub, kUnsigned32, kSetting, 0);
    }
  }
  s.add(0x6040, 0, kUnsigned16, kDemand, 0);
  s.add(0x6041, 0, kUnsigned16, kActual);
  s.add(0x605A, 0, kInteger16, kSetting, 6);
  s.add(0x6060, 0, kInteger8, kDemand, 0);
  s.add(0x6061, 0, kInteger8, kActual);
  s.add(0x6064, 0, kInteger32, kActual);
  s.add(0x606C, 0, kInteger32, kActual);
  s.add(0x6077, 0, kInteger16, kActual);
  s.add(0x603F, 0, kUnsigned16, kActual);
  return s;
}

/// A servo drive with every cyclic mode, and offsets.
inline Sheet servo() {
  Sheet s = common();
  s.add(0x1016, 1, kUnsigned32, kSetting, 0);
  s.add(0x6007, 0, kInteger16, kSetting, 0);
  s.add(0x6071, 0, kInteger16, kDemand, 0);
  s.add(0x607A, 0, kInteger32, kDemand, 0);
  s.add(0x60B1, 0, kInteger32, kDemand, 0);
  s.add(0x60B2, 0, kInteger16, kDemand, 0);
  s.add(0x60C2, 1, kUnsigned8, kSetting, 0);
  s.add(0x60C2, 2, kInteger8, kSetting, -3);
  s.add(0x60FF, 0, kInteger32, kDemand, 0);
  s.add(0x6502, 0, kUnsigned32, canopen::kRead, 0x3EF);
  return s;
}

/// Interpolated position only, two RPDOs, no heartbeat consumer but guarding.
inline Sheet interpolating() {
  Sheet s = common(2);
  s.add(0x100C, 0, kUnsigned16, kSetting, 0);
  s.add(0x100D, 0, kUnsigned8, kSetting, 0);
  s.add(0x60C1, 1, kInteger32, kDemand, 0);
  s.add(0x6502, 0, kUnsigned32, canopen::kRead, 0x43);
  return s;
}

/// One joint on such a drive, node 5, and the master.
struct SheetRig {
  using Change = void (*)(RobotConfig&);
  explicit SheetRig(const Sheet& s, Change change = nullptr)
      : robot(config(s, change)),
        drive(s.sheet, 5),
        state(robot.shape()),
        command(robot.shape()),
        parameters(initial_parameters(robot)) {
    const std::array<Bus*, 2> ends{&bus.master(), &other.master()};
    auto created = DriveMaster::create(robot, ends);
    if (!created) {
      error = created.error().to_string();
      return;
    }
    master = std::move(*created);
    ask(ControlMode::kPosition);
  }
  static RobotConfig config(const Sheet& s, Change change = nullptr) {
    RobotConfig robot = classic_config();
    robot.sensors.clear();
    robot.joints.resize(1);
    robot.boards.resize(1);
    robot.boards[0].node_id = 5;
    robot.boards[0].eds = "drive.eds";
    robot.boards[0].boot_time_ns = 6'000'000'000;
    robot.boards[0].sheet = std::make_shared<const DataSheet>(s.sheet);
    if (change != nullptr) change(robot);
    return robot;
  }
  void ask(ControlMode mode) { command.mode()[0] = static_cast<std::int8_t>(mode); }
  void step() {
    exchange();
    const rt::ScopedRealtime in_cycle;
    (void)master->send(command, parameters);
  }
  /// A cycle of the run's end. @return whether it has ended
  bool end() {
    exchange();
    const rt::ScopedRealtime in_cycle;
    return master->shut_down();
  }
  void exchange() {
    const CycleTime time{.cycle = cycle, .time_ns = static_cast<std::int64_t>(cycle) * 1'000'000};
    ++cycle;
    {
      const rt::ScopedRealtime in_cycle;
      master->cycle_begin(time);
    }
    drive.tick();
    for (const Frame& frame : bus.to_boards()) {
      drive.receive(frame);
      if (frame.length > 8) too_long = true;
    }
    bus.take_to_boards(bus.to_boards().size());
    (void)bus.boards().send(drive.out);
    drive.out.clear();
    const rt::ScopedRealtime in_cycle;
    (void)master->receive(state);
  }
  void steps(int count) {
    for (int i = 0; i < count; ++i) step();
  }
  [[nodiscard]] testing::AssertionResult bring_up(int most = 3000) {
    if (!master) return testing::AssertionFailure() << error;
    for (int i = 0; i < most && master->phase() == Phase::kBringUp; ++i) step();
    if (master->phase() == Phase::kOperational) return testing::AssertionSuccess();
    return testing::AssertionFailure() << master->status_text();
  }

  RobotConfig robot;
  SheetDrive drive;
  LoopbackBus bus, other;
  StateImage state;
  CommandImage command;
  ParameterImage parameters;
  std::unique_ptr<DriveMaster> master;
  std::string error;
  std::uint64_t cycle = 0;
  bool too_long = false;
};

inline constexpr double kRadPerCount = 2.0 * kPi / 36000.0;

}  // namespace tandem::hal::can::test
