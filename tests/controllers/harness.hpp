// Runs a bundled controller as the runtime does, against joints that follow perfectly.
// Layer: tests.  Thread: one.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <optional>
#include <string>
#include <vector>

#include "controllers/plugin_loader.hpp"
#include "hal/config/capabilities.hpp"
#include "rt/scoped_realtime.hpp"

namespace tandem::test {

inline std::vector<std::string> bundled_folder() {
  return {std::string(TANDEM_BINARY_DIR) + "/lib/controllers"};
}

class Harness {
 public:
  Harness(const hal::RobotConfig& config, const std::string& plugin, const std::string& parameters,
          const tandem_kernels* kernels = nullptr, std::span<const double> start_rad = {})
      : robot(hal::robot_of(config)),
        state(robot.shape()),
        command(robot.shape()),
        loaded_(load_controller(plugin, bundled_folder())),
        document(TomlDocument::parse(parameters, "experiment.toml").value()),
        gains(hal::initial_parameters(config)),
        setup(robot, gains, kernels, time.period_ns, document.root(), start_rad) {
    if (!loaded_) {
      ADD_FAILURE() << loaded_.error().to_string();
      return;
    }
    configured = controller().configure(setup);
    setup.parameters.finish();
  }

  [[nodiscard]] Controller& controller() { return **loaded_; }
  /// The first problem that the configuration met, or empty.
  [[nodiscard]] std::string problem() const {
    if (!document.diagnostics().empty()) return document.diagnostics().front().to_string();
    return configured ? "" : configured.error().to_string();
  }

  void start() {
    for (const auto& claim : setup.claims()) {
      command.mode()[claim.joint] = static_cast<std::int8_t>(claim.mode);
      command.interaction()[claim.joint] = static_cast<std::uint8_t>(claim.interaction);
    }
    const rt::ScopedRealtime in_the_cycle;
    controller().start(time, state, command);
  }
  /// One cycle; positions in the state then are those commanded.
  Code step() {
    state.cycle()[0] = time.cycle;
    state.time_ns()[0] = time.time_ns;
    Code code = Code::kOk;
    {
      const rt::ScopedRealtime in_the_cycle;
      code = controller().update(time, state, command);
      setup.io->parameters.seen();
    }
    for (const auto& claim : setup.claims()) {
      if (claim.mode != hal::ControlMode::kPosition) continue;
      state.position_rad()[claim.joint] = command.position_rad()[claim.joint];
    }
    ++time.cycle;
    time.time_ns += time.period_ns;
    return code;
  }
  Code run(double seconds) {
    Code code = Code::kOk;
    const auto cycles = static_cast<int>(seconds * 1e9 / static_cast<double>(time.period_ns) + 0.5);
    for (int i = 0; i < cycles && code == Code::kOk; ++i) code = step();
    return code;
  }

  /// Sets a live parameter between two cycles; of a list every element, or one.
  void set(const std::string& name, double value) {
    bool found = false;
    for (ParameterRow& row : setup.io->parameters.rows()) {
      if (row.name != name && row.list != name) continue;
      ASSERT_TRUE(row.facts.live) << name;
      setup.io->parameters.set(row, value);
      found = true;
    }
    ASSERT_TRUE(found) << name;
  }

  hal::Robot robot;
  hal::CycleTime time;
  hal::StateImage state;
  hal::CommandImage command;

 private:
  Result<LoadedController> loaded_;

 public:
  TomlDocument document;
  hal::ParameterImage gains;
  ControllerSetup setup;
  Status configured;
};

}  // namespace tandem::test
