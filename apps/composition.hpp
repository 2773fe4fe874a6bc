// Everything that a run needs, read, checked and put together: nothing has moved yet.
// `tandem run` runs it; `tandem check` stops here.
// Layer: apps.  Thread: main.
#pragma once

#include <cstdint>
#include <expected>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "apps/robot_files.hpp"
#include "base/result.hpp"
#include "hal/sim/sim_robot.hpp"
#include "model/kernel_library.hpp"
#include "runtime/controller_host.hpp"
#include "runtime/experiment.hpp"

namespace tandem::apps {

/// What the command line says instead of the experiment.
struct Overrides {
  std::optional<std::uint64_t> seed;
  std::optional<double> duration_s;
  std::string kernel_variant;
};

/// A controller as `check` tells of it.
struct ControllerNote {
  std::string name;
  std::string doc;  ///< its plugin's one line
};

struct Composition {
  runtime::Experiment experiment;  ///< overrides applied; its robot is completed
  model::KernelLibrary kernels;
  std::unique_ptr<sim::SimRobot> backend;
  std::unique_ptr<runtime::ControllerHost> controllers;
  std::vector<ControllerNote> notes;
};

/// Reads an experiment with all its files and composes it. Every error that can be found without
/// running is found here: experiment, robot, description, kernels, backend, plugins, parameters,
/// claims.
[[nodiscard]] std::expected<std::unique_ptr<Composition>, Diagnostics> compose(
    const std::string& experiment, const Overrides& overrides);

}  // namespace tandem::apps
