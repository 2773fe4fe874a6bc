// A robot whose cycles a test makes up, for conditions and expectations.
// Layer: tests.  Thread: main.
#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <memory>

#include "hal/robot.hpp"
#include "runtime/condition/quantity.hpp"

namespace tandem::runtime::test {

struct Depth : hal::SignalBlock {
  Depth() : depth(declare("depth", "m", "of the squat", 1)), gait(declare("gait", "", "", 2)) {
    EXPECT_TRUE(close());
  }
  double *depth, *gait;
};

/// A knee that turns, a lift that slides, two feet, an IMU; a controller with signals.
struct ConditionRobot {
  ConditionRobot() {
    robot.name = "test";
    robot.joints.resize(2);
    robot.joints[0].name = "knee";
    robot.joints[1].name = "lift-1";
    robot.joints[1].slides = true;
    robot.sensors = {
        {.name = "sole", .type = hal::SensorType::kForceTorque, .joint = {}, .link = {}},
        {.name = "imu", .type = hal::SensorType::kImu, .joint = {}, .link = {}}};
    robot.feet = {{.site = "left", .points_m = {}}, {.site = "right", .points_m = {}}};
    robot.floating_base = true;
    estimate.base_valid()[0] = 1;
    truth.base_quaternion()[3] = 1.0;
    at(10);
  }
  /// The cycle, of 1 ms.
  void at(std::uint64_t number) {
    time = {number, static_cast<std::int64_t>(number) * 1'000'000, 1'000'000};
    state.cycle()[0] = number;
    state.time_ns()[0] = time.time_ns;
  }
  [[nodiscard]] QuantityNames names() const {
    return {.robot = robot,
            .state = state.layout(),
            .command = command.layout(),
            .truth = &truth.layout(),
            .estimate = &estimate.layout(),
            .signals = {{"squat", block}}};
  }
  [[nodiscard]] hal::CycleView view() const {
    return {.time = time,
            .phase = phase,
            .read_code = Code::kOk,
            .state = state,
            .command = command,
            .truth = &truth,
            .estimate = &estimate,
            .times = {},
            .faults = faults};
  }

  hal::Robot robot;
  hal::StateImage state{{.joints = 2, .sensor_channels = {6, 10}}};
  hal::CommandImage command{{.joints = 2, .sensor_channels = {6, 10}}};
  hal::TruthImage truth{2, 2};
  hal::EstimateImage estimate{{.base = 1, .feet = 2, .joints = 2, .wrenches = 0}};
  std::shared_ptr<Depth> block = std::make_shared<Depth>();
  hal::CycleTime time;
  hal::RunPhase phase = hal::RunPhase::kRunning;
  std::uint64_t faults = 0;
};

}  // namespace tandem::runtime::test
