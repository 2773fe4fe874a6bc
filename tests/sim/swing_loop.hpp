// The swing behind its drive master, cycle by cycle, without the runtime.
#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <vector>

#include "base/archive.hpp"
#include "hal/config/capabilities.hpp"
#include "tests/sim/swing_robot.hpp"

namespace tandem::test {

/// The swing in its loop, which holds the position that it finds.
struct SwingLoop {
  explicit SwingLoop(const hal::RobotConfig& config, sim::SimRobotConfig sim = {.posture = "up"},
                     int order = 2)
      : robot(config),
        state(config.shape()),
        command(config.shape()),
        parameters(hal::initial_parameters(config)) {
    auto made = sim::SimRobot::create(config, swing_kernels(order), sim);
    EXPECT_TRUE(made.has_value()) << made.error().to_string();
    sim_robot = std::move(*made);
    time.period_ns = sim.period_ns;
  }
  void step() {
    time.time_ns = static_cast<std::int64_t>(time.cycle) * time.period_ns;
    read = sim_robot->read(time, state);
    if (sim_robot->phase() != hal::Phase::kOperational) {
      command.position_rad()[0] = state.position_rad()[0];
      command.mode()[0] = static_cast<std::int8_t>(hal::ControlMode::kPosition);
    }
    written = sim_robot->write(command, parameters);
    ++time.cycle;
  }
  void run(int cycles) {
    for (int i = 0; i < cycles; ++i) step();
  }
  void bring_up() {
    for (int i = 0; i < 5000 && sim_robot->phase() != hal::Phase::kOperational; ++i) step();
    ASSERT_EQ(sim_robot->phase(), hal::Phase::kOperational) << sim_robot->status_text();
  }
  std::vector<std::byte> bytes() {
    Archive ar;
    EXPECT_TRUE(sim_robot->archive(ar));
    ar(state, command, time);
    return {ar.bytes().begin(), ar.bytes().end()};
  }

  hal::RobotConfig robot;
  hal::StateImage state;
  hal::CommandImage command;
  hal::ParameterImage parameters;
  hal::CycleTime time;
  std::unique_ptr<sim::SimRobot> sim_robot;
  Code read = Code::kOk, written = Code::kOk;
};

}  // namespace tandem::test
