// A run of a bundled robot as `tandem run` runs it: experiment, generated kernels, plugins, the
// whole chain. A test that uses one depends on the targets kernels_NAME and controller_NAME.
#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <stdexcept>
#include <string>
#include <utility>

#include "runtime/run/run.hpp"

namespace tandem::runtime {

/// What Run::open() makes of config/ROBOT/NAME.toml, or an exception that says why not.
struct BundledRun {
  BundledRun(const std::string& robot, const std::string& name, Overrides overrides = {},
             const RunParts& parts = {}, const Run::Connect& connect = {}) {
    overrides.no_build = true;
    auto opened = Run::open(TANDEM_SOURCE_DIR "/config/" + robot + "/" + name + ".toml", overrides,
                            parts, connect);
    if (!opened) throw std::runtime_error(opened.error().front().to_string());
    run = std::move(*opened);
    cycle = &run->cycle();
    if (run->is_simulated()) backend = &run->robot();
    experiment = &run->experiment();
  }
  void run_to(RunPhase phase) {
    while (cycle->phase() != phase && cycle->step()) {
    }
    ASSERT_EQ(cycle->phase(), phase) << backend->status_text();
  }
  void steps(int count) {
    for (int i = 0; i < count; ++i) (void)cycle->step();
  }
  /// State, command and truth of the next `count` cycles.
  std::vector<std::byte> bytes(int count) {
    std::vector<std::byte> all;
    for (int i = 0; i < count; ++i) {
      EXPECT_TRUE(cycle->step());
      for (const auto one : {run->state().bytes(), run->command().bytes(), run->truth().bytes()}) {
        all.insert(all.end(), one.begin(), one.end());
      }
    }
    return all;
  }

  std::unique_ptr<Run> run;
  // Its.
  RobotCycle* cycle = nullptr;
  sim::SimRobot* backend = nullptr;  ///< null: another one is connected
  const Experiment* experiment = nullptr;
};

}  // namespace tandem::runtime
