// A bundled robot's experiment with [estimation], noise of its sensors and pushes, in the whole
// chain: what the cycle estimates beside the simulation's truth.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "tests/runtime/bundled_run.hpp"

namespace tandem::runtime {

/// Standard deviations and biases that stand for a good industrial IMU (1 kHz) and six-axis
/// sensors.
inline void add_noise(hal::RobotConfig& robot) {
  for (hal::SensorConfig& sensor : robot.sensors) {
    if (sensor.type == hal::SensorType::kImu) {
      sensor.noise = {0, 0, 0, 0, 0.003, 0.003, 0.003, 0.05, 0.05, 0.05};
      sensor.bias = {0, 0, 0, 0, 0.004, -0.003, 0.002, 0.03, -0.04, 0.05};
    } else {
      sensor.noise = {1.0, 1.0, 1.0, 0.02, 0.02, 0.02};
    }
  }
  for (hal::JointConfig& joint : robot.joints) joint.torque_noise_Nm = 2e-4 * joint.rated_torque_Nm;
}

struct EstimatedRun : BundledRun {
  struct Options {
    std::uint64_t seed = 1;
    bool noise = true;
    estimation::EstimationConfig estimation = {};
    std::function<void(Experiment&)> change = [](Experiment&) {};
    std::string on_fault = {};
  };
  EstimatedRun(const std::string& robot, const std::string& name, const Options& options)
      : BundledRun(
            robot, name,
            {.seed = options.seed, .on_fault = options.on_fault, .change = [&](Experiment& e) {
               e.estimation = options.estimation;
               if (options.noise) add_noise(e.robot);
               options.change(e);
             }}) {}
  [[nodiscard]] const hal::EstimateImage& estimate() const { return run->estimate(); }
  [[nodiscard]] const hal::TruthImage& truth() const { return run->truth(); }
  [[nodiscard]] double time_s() const { return 1e-9 * static_cast<double>(truth().time_ns()[0]); }
  /// Until `fault` of those that were injected strikes.
  void run_to_fault(std::size_t fault = 0) {
    while (backend->robot().faults()[fault].active == 0 && cycle->step()) {
    }
  }
};

/// A push on the body of a joint, from so long after the drives are enabled.
inline sim::ScenarioFault push_on(const hal::RobotConfig& robot, const std::string& joint,
                                  std::array<double, 3> force_N, double after_enabled_s,
                                  double for_s, std::array<double, 3> point_m = {}) {
  sim::ScenarioFault push;
  push.kind = hal::FaultKind::kPush;
  push.from = sim::FaultFrom::kEnabled;
  push.joint = robot.joint_index(joint);
  push.force_N = force_N;
  push.point_m = point_m;
  push.start_ns = static_cast<std::int64_t>(after_enabled_s * 1e9);
  push.duration_ns = static_cast<std::int64_t>(for_s * 1e9);
  return push;
}

/// The filter's settings for add_noise()'s sensors.
inline estimation::EstimationConfig for_legs() {
  return {.base =
              estimation::BaseConfig{
                  .imu = {}, .gyro_noise_rad_s = 0.003, .accelerometer_noise_m_s2 = 0.05},
          .observer = estimation::ObserverConfig{},
          .collision = std::nullopt};
}

}  // namespace tandem::runtime
