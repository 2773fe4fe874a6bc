// A robot's squat as `tandem run` runs it: experiment, generated kernels, plugin, whole chain.
#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <string>

#include "controllers/plugin_loader.hpp"
#include "model/kernel_library.hpp"
#include "rt/clock.hpp"
#include "runtime/experiment.hpp"
#include "runtime/robot_cycle.hpp"

namespace tandem::runtime {

inline constexpr std::uint64_t kRunning = 1500;  // cycles: into the first descent

/// The experiment, composed and ready to run; for its own duration when `cycles` is 0.
struct Squat {
  explicit Squat(const std::string& robot, std::uint64_t cycles = kRunning, double rate = 0.0,
                 log::Recorder* recorder = nullptr, bool bus_timing = false,
                 const std::string& name = "squat", const CycleConfig& config = {})
      : wanted(config) {
    auto read =
        read_experiment(std::string(TANDEM_SOURCE_DIR) + "/config/" + robot + "/" + name + ".toml");
    if (!read) {
      ADD_FAILURE() << read.error().at(0).to_string();
      return;
    }
    experiment = std::make_unique<Experiment>(std::move(*read));
    experiment->loop.rate = rate;
    experiment->sim.bus_timing = bus_timing;
    compose(robot, cycles, recorder);
  }
  void compose(const std::string& robot, std::uint64_t cycles, log::Recorder* recorder) {
    auto loaded = model::load_kernels(std::string(TANDEM_BINARY_DIR) + "/lib/models/" + robot +
                                      "_kernels.so");
    ASSERT_TRUE(loaded) << loaded.error().to_string();
    kernels = *loaded;
    Experiment& e = *experiment;
    host = std::make_unique<ControllerHost>(e.robot, kernels.get(), e.loop.period_ns);
    for (const ControllerSpec& spec : e.controllers) {
      auto plugin =
          load_controller(spec.plugin, {std::string(TANDEM_BINARY_DIR) + "/lib/controllers"});
      ASSERT_TRUE(plugin) << plugin.error().to_string();
      const Status added = host->add(spec.name, std::move(*plugin), spec.parameters);
      ASSERT_TRUE(added) << added.error().to_string();
    }
    auto made = sim::SimRobot::create(e.robot, kernels.get(), e.sim_robot_config());
    ASSERT_TRUE(made) << made.error().to_string();
    backend = std::move(*made);
    CycleConfig config = wanted;
    config.loop = e.loop;
    config.running_cycles = cycles == 0 ? e.cycles() : cycles;
    config.settle_cycles = e.settle_cycles();
    cycle = std::make_unique<RobotCycle>(
        CycleParts{e.robot, *backend, *host, clock, recorder, &backend->truth()}, config);
  }
  void run_to(RunPhase phase) {
    while (cycle->phase() != phase && cycle->step()) {
    }
    ASSERT_EQ(cycle->phase(), phase) << backend->status_text();
  }

  CycleConfig wanted;  ///< but for what the experiment says
  std::unique_ptr<Experiment> experiment;
  model::KernelLibrary kernels;
  rt::WallClock clock;
  std::unique_ptr<ControllerHost> host;
  std::unique_ptr<sim::SimRobot> backend;
  std::unique_ptr<RobotCycle> cycle;
};

}  // namespace tandem::runtime
