#include "runtime/run/fork.hpp"

#include <utility>

#include "hal/config/capabilities.hpp"
#include "rt/clock.hpp"
#include "runtime/robot_cycle.hpp"
#include "runtime/run/operator_link.hpp"

namespace tandem::runtime {
namespace {

struct RunFork final : internal_model::Fork {
  [[nodiscard]] bool diverged() const override { return robot->plant().diverged(); }

  internal_model::NoPredictor nobody;
  rt::WallClock clock;
  std::unique_ptr<ControllerHost> controllers;
  std::unique_ptr<estimation::Estimator> estimator;  // as the run's, or null
  std::unique_ptr<hal::Backend> backend;
  sim::SimRobot* robot = nullptr;  // the backend, or behind its link
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
    const Status added = host.add(spec.name, std::move(*plugin), spec.parameters, spec.active);
    if (!added) return added;
  }
  if (c.owner == nullptr) return {};
  const auto nothing = TomlDocument::parse("", e.file);
  return host.add(kOwnerController, std::make_shared<OwnerController>(), nothing->root(), false);
}

}  // namespace

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
                 .estimator = fork->estimator.get()},
      ahead);
  fork->cycle = fork->own.get();
  return fork;
}

}  // namespace tandem::runtime
