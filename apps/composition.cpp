#include "apps/composition.hpp"

#include <fmt/core.h>

#include <filesystem>

#include "apps/kernel_store.hpp"
#include "controllers/plugin_loader.hpp"
#include "hal/ethercat-can/bus_load.hpp"
#include "hal/ethercat-can/can_backend.hpp"
#include "hal/sim/scenario.hpp"

namespace tandem::apps {
namespace {

/// Errors of several stages, so that one reading finds as many as it can.
class Collector {
 public:
  void add(Error error, const std::string& file, int line) {
    if (error.file.empty()) {
      error.file = file;
      error.line = line;
    }
    errors_.push_back(std::move(error));
  }
  void add(const Diagnostics& errors) {
    errors_.insert(errors_.end(), errors.begin(), errors.end());
  }
  [[nodiscard]] bool empty() const { return errors_.empty(); }
  [[nodiscard]] std::unexpected<Diagnostics> give() { return std::unexpected(std::move(errors_)); }

 private:
  Diagnostics errors_;
};

/// A plugin's path is relative to the experiment's file; its bare name is looked for.
std::string plugin_path(const runtime::Experiment& e, const std::string& plugin) {
  if (!plugin.contains('/')) return plugin;
  const std::filesystem::path path = plugin;
  if (path.is_absolute()) return plugin;
  return (std::filesystem::path(e.document.folder()) / path).lexically_normal().string();
}

void add_controllers(Composition& c, Collector& errors) {
  const std::vector<std::string> folders = controller_folders();
  for (const runtime::ControllerSpec& spec : c.experiment.controllers) {
    Result<LoadedController> loaded =
        load_controller(plugin_path(c.experiment, spec.plugin), folders);
    const int line = spec.parameters.line();
    if (!loaded) {
      errors.add(loaded.error(), c.experiment.file, line);
      continue;
    }
    const std::string doc = loaded->plugin().doc;
    if (c.controllers == nullptr) continue;  // without kernels: only that it can be loaded
    const Status added = c.controllers->add(spec.name, std::move(*loaded), spec.parameters, spec.active);
    if (!added) {
      errors.add(added.error(), c.experiment.file, line);
      continue;
    }
    c.notes.push_back({spec.name, doc, spec.active});
  }
  errors.add(c.experiment.document.diagnostics());
}

}  // namespace

std::string hal_name(const runtime::HalOptions& hal) {
  if (hal.backend == runtime::BackendKind::kSim) return "sim";
  return hal.lockstep ? "can lockstep" : "can";
}

std::expected<std::unique_ptr<Composition>, Diagnostics> compose(const std::string& file,
                                                                 const Overrides& overrides) {
  auto experiment = runtime::read_experiment(file);
  if (!experiment) return std::unexpected(experiment.error());
  auto c = std::make_unique<Composition>();
  runtime::Experiment& e = c->experiment;
  e = std::move(*experiment);
  e.seed = overrides.seed.value_or(e.seed);
  e.duration_s = overrides.duration_s.value_or(e.duration_s);
  if (!overrides.kernel_variant.empty()) e.kernel_variant = overrides.kernel_variant;
  e.hal.backend = overrides.backend.value_or(e.hal.backend);
  e.hal.lockstep = e.hal.lockstep || overrides.lockstep;
  e.dds.enabled = overrides.dds.value_or(e.dds.enabled);
  e.dds.domain = overrides.domain.value_or(e.dds.domain);

  Collector errors;
  if (Status done = replace_interfaces(e.robot, overrides.interfaces); !done) {
    return std::unexpected(Diagnostics{done.error()});
  }
  const auto robot = with_description(e.robot);
  if (!robot) return std::unexpected(robot.error());
  c->tree = robot->tree;
  if (auto kernels = find_kernels(*robot, e.kernel_variant)) {
    c->kernels = std::move(*kernels);
    c->controllers =
        std::make_unique<runtime::ControllerHost>(e.robot, c->kernels.get(), e.loop.period_ns);
  } else {
    errors.add(kernels.error(), e.robot.file, 0);
  }
  errors.add(hal::can::check_bus_load(e.robot, e.loop.period_ns));
  add_controllers(*c, errors);
  if (!errors.empty()) return errors.give();
  if (e.hal.backend == runtime::BackendKind::kCan) {
    if (overrides.scenario.empty()) return c;
    errors.add({.message = "faults are injected on the other end of the wire",
                .hint = "give --scenario to `tandem emulate`",
                .file = overrides.scenario,
                .key = {}},
               overrides.scenario, 0);
    return errors.give();
  }

  sim::SimRobotConfig sim = e.sim_robot_config();
  if (!overrides.scenario.empty()) {
    auto faults = sim::read_scenario(overrides.scenario, e.robot, e.loop.period_ns);
    if (!faults) return std::unexpected(faults.error());
    sim.faults = std::move(*faults);
  }
  auto backend = sim::SimRobot::create(e.robot, c->kernels.get(), sim);
  if (!backend) {
    errors.add(backend.error(), e.robot.file, 0);
    return errors.give();
  }
  c->sim = backend->get();
  c->master = &c->sim->master();
  c->backend = std::move(*backend);
  return c;
}

Diagnostics connect(Composition& c, const std::string& record_frames) {
  const runtime::Experiment& e = c.experiment;
  if (e.hal.backend != runtime::BackendKind::kCan) {
    if (record_frames.empty()) return {};
    return {fail("--record-frames: a robot in this process has no bus to record",
                 "add --hal can, and start tandem emulate")
                .error()};
  }
  auto sockets = CanSockets::open(e.robot, hal::can::SocketSide::kMaster, !e.hal.lockstep);
  if (!sockets) return sockets.error();
  c.sockets = std::move(*sockets);
  const auto ends = c.sockets->buses();
  std::vector<hal::can::Bus*> buses(ends.begin(), ends.end());
  if (!record_frames.empty()) {
    auto record = hal::can::FrameRecord::open(record_frames);
    if (!record) return {record.error()};
    c.frames = std::move(*record);
    for (std::size_t b = 0; b < buses.size(); ++b) {
      buses[b] = &c.frames->watch(*buses[b], e.robot.buses[b].interface);
    }
  }
  auto backend = hal::can::CanBackend::create(
      e.robot, buses, *c.sockets,
      {.lockstep = e.hal.lockstep, .answer_window = e.hal.answer_window});
  if (!backend) return {backend.error()};
  c.master = &(*backend)->master();
  c.backend = std::move(*backend);
  return {};
}

}  // namespace tandem::apps
