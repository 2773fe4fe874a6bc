#include "runtime/run/run.hpp"

#include <utility>

#include "hal/config/capabilities.hpp"
#include "runtime/run/identity.hpp"
#include "runtime/run/operator_link.hpp"
#include "runtime/time_machine.hpp"

namespace tandem::runtime {
namespace {

Diagnostics connect_to(Composition& c, const Run::Connect& connect) {
  if (connect) return connect(c);
  if (c.experiment.hal.backend == BackendKind::kSim) return {};
  return {{.message = "its robot is not in this process",
           .hint = "override `hal` by \"sim\", connect it, or use `tandem run`",
           .file = c.experiment.file,
           .key = "hal.backend"}};
}

struct RunFork final : internal_model::Fork {
  [[nodiscard]] bool diverged() const override { return robot->plant().diverged(); }

  internal_model::NoPredictor nobody;
  rt::WallClock clock;
  std::unique_ptr<ControllerHost> controllers;
  std::unique_ptr<estimation::Estimator> estimator;  // as the run's, or null
  std::unique_ptr<hal::Backend> backend;
  sim::SimRobot* robot = nullptr;  // the backend, or behind its link
  std::unique_ptr<Events> events;
  std::unique_ptr<RobotCycle> own;
};

/// The same controllers in the same order.
Status add_controllers_again(const Composition& c, RunFork& fork) {
  ControllerHost& host = *fork.controllers;
  const Experiment& e = c.experiment;
  for (const ControllerSpec& spec : e.controllers) {
    auto plugin = load_plugin(e, spec);
    if (!plugin) return std::unexpected(plugin.error());
    if (plugin->plugin().lacks_archive) fork.unarchived.push_back(spec.name);
    const Status added =
        host.add(spec.name, std::move(*plugin), spec.parameters, spec.active, spec.inputs);
    if (!added) return added;
  }
  if (c.owner == nullptr) return {};
  const auto nothing = TomlDocument::parse("", e.file);
  return host.add(kOwnerController, std::make_shared<OwnerController>(), nothing->root(), false);
}

/// The copy of a run that a prediction runs ahead in: its controllers once more, on the internal
/// model, or on the run's own simulation.
/// Errors: a plugin that cannot be loaded or configured any more; SimRobot::create()'s.
Result<std::unique_ptr<internal_model::Fork>> make_fork(const Composition& c,
                                                        const CycleConfig& config) {
  const Experiment& e = c.experiment;
  auto fork = std::make_unique<RunFork>();
  fork->controllers = std::make_unique<ControllerHost>(e.robot, c.kernels.get(), e.loop.period_ns);
  fork->controllers->start_from(start_of(e));
  fork->controllers->predict_by(&fork->nobody);
  if (c.estimator != nullptr) {
    auto estimator = estimation::Estimator::make(hal::robot_of(e.robot), c.kernels.get(),
                                                 e.estimation, e.loop.period_ns);
    if (!estimator) return std::unexpected(estimator.error());
    fork->estimator = std::move(*estimator);
    fork->controllers->show_estimate(&fork->estimator->image());
  }
  if (const Status added = add_controllers_again(c, *fork); !added) {
    return std::unexpected(added.error());
  }
  const bool beside = c.parallel != nullptr;
  sim::SimRobotConfig sim = c.simulation;
  sim.truth = true;
  auto robot = sim::SimRobot::create(beside ? e.parallel->robot : e.robot,
                                     (beside ? c.parallel_kernels : c.kernels).get(), sim);
  if (!robot) return std::unexpected(robot.error());
  fork->robot = robot->get();
  fork->truth = &fork->robot->truth();
  fork->backend = std::move(*robot);
  if (c.tele != nullptr && !beside) {  // the operator's loop: its link and its robot
    auto link = link_to(c, std::move(fork->backend));
    if (!link) return std::unexpected(link.error().front());
    fork->backend = std::move(*link);
  }
  if (c.events != nullptr) fork->events = c.events->idle_copy();
  CycleConfig ahead = config;
  ahead.loop.pacing = rt::Pacing::kSimulated;
  ahead.loop.rate = 0.0;
  ahead.loop.start_paused = false;
  ahead.trace_cycles = 0;
  fork->own = std::make_unique<RobotCycle>(
      CycleParts{.robot = e.robot,
                 .backend = *fork->backend,
                 .controllers = *fork->controllers,
                 .clock = fork->clock,
                 .truth = truth_of(c) != nullptr ? fork->truth : nullptr,
                 .estimator = fork->estimator.get(),
                 .identity = identity_of(c, config),
                 .events = fork->events.get()},
      ahead);
  fork->cycle = fork->own.get();
  return fork;
}

}  // namespace

std::string why_no_past(const Composition& c) {
  if (c.backend->pace() != hal::Pace::kSimulatedClock) return "its time is real";
  const bool boards_along =
      c.experiment.hal.backend == BackendKind::kWire;  // they stand in lockstep
  if (c.sim == nullptr && !boards_along) return "its boards are in another process";
  if (c.owner != nullptr) return "another process may own its robot";
  if (c.predictor != nullptr && c.predictor->is_prepared()) {
    return "a controller acts on predictions, which are not kept";
  }
  return {};
}

std::expected<std::unique_ptr<Run>, Diagnostics> Run::open(const std::string& experiment,
                                                           const Overrides& overrides,
                                                           const RunParts& parts,
                                                           const Connect& connect) {
  auto c = composed(experiment, overrides);
  if (!c) return std::unexpected(c.error());
  if (auto errors = connect_to(**c, connect); !errors.empty()) return std::unexpected(errors);
  auto run = std::make_unique<Run>(**c, overrides, parts);
  run->own_ = std::move(*c);
  return run;
}

Run::Run(Composition& c, const Overrides& overrides, const RunParts& parts) : c_(&c) {
  const Experiment& e = c.experiment;
  const CycleConfig config = cycle_config(c, overrides);
  hal::Backend* backend = c.backend.get();
  if (c.parallel != nullptr) {
    const bool both_float = c.sim != nullptr && e.robot.model.floating_base;
    parallel_.emplace(
        internal_model::ParallelParts{.first = *c.backend,
                                      .second = *c.parallel,
                                      .truth = e.sim.ground_truth ? &c.parallel->truth() : nullptr,
                                      .recorder = parts.recorder,
                                      .first_truth = both_float ? &c.sim->truth() : nullptr},
        e.robot.shape(), c.controllers->gains(), e.loop.period_ns);
    backend = &parallel_->backend();  // passes every call on to the first robot, and tapes it
  }
  if (!overrides.later.empty() && c.events != nullptr) c.events->keep_apart();
  observers_.add(c.expectations.get());
  if (parts.time_machine != nullptr) parts.time_machine->judge_by(c.expectations.get());
  observers_.add(parts.observer);
  cycle_.emplace(CycleParts{.robot = e.robot,
                            .backend = *backend,
                            .controllers = *c.controllers,
                            .clock = parts.clock == nullptr ? clock_ : *parts.clock,
                            .recorder = parts.recorder,
                            .truth = truth_of(c),
                            .observer = observers_.observer(),
                            .owner = {parts.owner, c.owner.get(), c.owner_slot},
                            .estimator = c.estimator.get(),
                            .snapshots = c.predictor.get(),
                            .identity = identity_of(c, config, overrides.later),
                            .time_machine = parts.time_machine,
                            .events = c.events.get()},
                 config);
  if (c.predictor != nullptr) {
    c.predictor->attach(*cycle_, parallel(), [&c, config] { return make_fork(c, config); });
  }
  if (parallel_) parallel_->start();
}

Run::~Run() {
  if (c_->predictor != nullptr) c_->predictor->close();
}

}  // namespace tandem::runtime
