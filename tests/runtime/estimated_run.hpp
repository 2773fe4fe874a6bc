// A bundled robot's experiment with [estimation], noise of its sensors and pushes, in the whole
// chain: what the cycle estimates beside the simulation's truth.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "controllers/plugin_loader.hpp"
#include "estimation/estimator.hpp"
#include "hal/config/capabilities.hpp"
#include "model/kernel_library.hpp"
#include "rt/clock.hpp"
#include "runtime/experiment.hpp"
#include "runtime/robot_cycle.hpp"

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

struct EstimatedRun {
  struct Options {
    std::uint64_t seed = 1;
    bool noise = true;
    std::vector<sim::Fault> pushes = {};
    estimation::EstimationConfig estimation = {};
    std::function<void(Experiment&)> change = [](Experiment&) {};
    CycleConfig cycle = {};
    log::Recorder* recorder = nullptr;
  };
  EstimatedRun(const std::string& robot, const std::string& name, const Options& options) {
    const std::string folder = std::string(TANDEM_SOURCE_DIR) + "/config/" + robot;
    auto read = read_experiment(folder + "/" + name + ".toml");
    if (!read) {
      ADD_FAILURE() << read.error().at(0).to_string();
      return;
    }
    experiment = std::make_unique<Experiment>(std::move(*read));
    experiment->seed = options.seed;
    if (options.noise) add_noise(experiment->robot);
    options.change(*experiment);
    compose(options);
  }
  void compose(const Options& options) {
    Experiment& e = *experiment;
    auto loaded = model::load_kernels(std::string(TANDEM_BINARY_DIR) + "/lib/models/" +
                                      e.robot.name + "_kernels.so");
    ASSERT_TRUE(loaded) << loaded.error().to_string();
    kernels = *loaded;
    auto made = estimation::Estimator::make(hal::robot_of(e.robot), kernels.get(),
                                            options.estimation, e.loop.period_ns);
    ASSERT_TRUE(made) << made.error().to_string();
    estimator = std::move(*made);
    host = std::make_unique<ControllerHost>(e.robot, kernels.get(), e.loop.period_ns);
    host->show_estimate(&estimator->image());
    for (const ControllerSpec& spec : e.controllers) {
      auto plugin =
          load_controller(spec.plugin, {std::string(TANDEM_BINARY_DIR) + "/lib/controllers"});
      ASSERT_TRUE(plugin) << plugin.error().to_string();
      ASSERT_TRUE(host->add(spec.name, std::move(*plugin), spec.parameters));
    }
    sim::SimRobotConfig sim = e.sim_robot_config();
    sim.faults = options.pushes;
    auto simulated = sim::SimRobot::create(e.robot, kernels.get(), sim);
    ASSERT_TRUE(simulated) << simulated.error().to_string();
    backend = std::move(*simulated);
    CycleConfig config = options.cycle;
    config.loop = e.loop;
    config.running_cycles = e.cycles();
    config.settle_cycles = e.settle_cycles();
    cycle = std::make_unique<RobotCycle>(CycleParts{.robot = e.robot,
                                                    .backend = *backend,
                                                    .controllers = *host,
                                                    .clock = clock,
                                                    .recorder = options.recorder,
                                                    .truth = &backend->truth(),
                                                    .estimator = estimator.get()},
                                         config);
  }
  void run_to(RunPhase phase) {
    while (cycle->phase() != phase && cycle->step()) {
    }
    ASSERT_EQ(cycle->phase(), phase) << backend->status_text();
  }
  [[nodiscard]] const hal::EstimateImage& estimate() const { return estimator->image(); }
  [[nodiscard]] const hal::TruthImage& truth() const { return backend->truth(); }
  [[nodiscard]] double time_s() const { return 1e-9 * static_cast<double>(truth().time_ns()[0]); }

  std::unique_ptr<Experiment> experiment;
  model::KernelLibrary kernels;
  rt::WallClock clock;
  std::unique_ptr<estimation::Estimator> estimator;
  std::unique_ptr<ControllerHost> host;
  std::unique_ptr<sim::SimRobot> backend;
  std::unique_ptr<RobotCycle> cycle;
};

/// A push on the body of a joint, from so long after the drives are enabled.
inline sim::Fault push_on(const hal::RobotConfig& robot, const std::string& joint,
                          std::array<double, 3> force_N, double after_enabled_s, double for_s,
                          std::array<double, 3> point_m = {}) {
  sim::Fault push;
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
