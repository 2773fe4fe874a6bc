// How a run ended, and what of it was tolerated.
#include "apps/run/run_summary.hpp"

#include <fmt/core.h>
#include <signal.h>

#include <cstring>

#include "base/counted.hpp"
#include "rt/stop_signal.hpp"
#include "runtime/run/plant_weight.hpp"

namespace tandem::apps {

std::uint64_t RunSummary::planned_cycles() const { return composition.experiment.cycles(); }

bool RunSummary::cut_short() const {
  return interrupted_by != 0 && cycle.running_cycles() < planned_cycles();
}

std::string RunSummary::ended() const {
  const bool early = planned_cycles() == 0 || cycle.running_cycles() < planned_cycles();
  if (early && interrupted_by != 0) {
    const char* how = planned_cycles() == 0 ? "stopped" : "interrupted";
    const char* name = ::sigabbrev_np(interrupted_by);
    if (name != nullptr) return fmt::format("{} by SIG{}", how, name);
    return fmt::format("{} by SIGRTMIN+{}", how, interrupted_by - SIGRTMIN);
  }
  if (!faults.empty()) return "by a fault";
  if (early && rt::stop_requested()) return "nobody reads its output any more";
  if (!early) return "as planned";
  const bool asked = server != nullptr || cycle.inbox().bell().ended();
  return asked ? "on request" : "its controllers were done";
}

RunFigures RunSummary::run() const {
  const runtime::Composition& c = composition;
  return {.experiment = &c.experiment,
          .cycle = &cycle,
          .controllers = c.controllers.get(),
          .ground = runtime::ground_of(c, cycle),
          .kernel_variant = c.kernels->variant,
          .expectations = c.expectations.get()};
}

std::optional<ParallelSummary> RunSummary::parallel_summary() const {
  if (!parallel) return std::nullopt;
  return ParallelSummary{&composition.experiment.parallel->robot, &*parallel, differences};
}

double RunSummary::realtime_factor() const {
  return times.running_s > 0.0 ? simulated_s() / times.running_s : 0.0;
}

double RunSummary::simulated_s() const {
  const auto cycles = static_cast<std::int64_t>(cycle.running_cycles() - cycles_before);
  return static_cast<double>(cycles * composition.experiment.loop.period_ns) / 1e9;
}

namespace {

/// The faults of the scenario that were due after the run's end.
std::vector<std::string> due_after_end(const WiredComposition& c,
                                       const runtime::RobotCycle& cycle) {
  std::vector<std::string> all;
  if (c.sim == nullptr) return all;
  const double ended_s = static_cast<double>(cycle.state().time_ns()[0]) * 1e-9;
  for (const sim::FaultSlot& slot : c.sim->robot().faults()) {
    if (slot.acted != 0) continue;
    const bool enabled = slot.fault.from == sim::FaultFrom::kEnabled;
    const bool carried = slot.fault.kind == hal::FaultKind::kPayload;
    all.push_back(fmt::format(
        "{} was never {}: it is due {:.3f} s after {}, and the run ended {:.3f} "
        "s after its first SYNC",
        carried ? "the payload " + c.sim->robot().payload_text(c.sim->robot().payload_number(slot))
                : fmt::format("the fault '{}'", hal::to_string(slot.fault.kind)),
        carried ? "picked up" : "injected", static_cast<double>(slot.fault.start_ns) * 1e-9,
        enabled ? "the drives are enabled" : "the first SYNC", ended_s));
  }
  return all;
}

/// Inputs whose samples were refused, with the last reason.
std::vector<std::string> refused_samples(const WiredComposition& c) {
  std::vector<std::string> all;
  for (const auto& one : c.controllers->owned()) {
    if (one == nullptr) continue;
    for (const auto& port : one->inputs) {
      const runtime::InputLook look = port->look();
      if (look.counts.refused == 0) continue;
      all.push_back(fmt::format("the input {} refused {}; the last: {}", port->full_name(),
                                counted(look.counts.refused, "sample"), look.why));
    }
  }
  return all;
}

}  // namespace

std::vector<std::string> RunSummary::warnings() const {
  std::vector<std::string> all;
  if (composition.can != nullptr) {
    all = composition.can->warnings();
  } else if (composition.master != nullptr) {
    all = composition.master->warnings();
  }
  const bool estimates =
      composition.estimator != nullptr && composition.estimator->image().estimates_base();
  if (estimates && cycle.running_cycles() > 0 && cycle.statistics().estimate().base_cycles == 0) {
    all.push_back(fmt::format(
        "the base's estimate never started, so no external torque and no collision was looked for: "
        "the robot has to stand still on its feet for {} s ([estimation.base] rest_s)",
        composition.experiment.estimation.base->rest_s));
  }
  for (std::string& one : due_after_end(composition, cycle)) all.push_back(std::move(one));
  for (std::string& one : refused_samples(composition)) all.push_back(std::move(one));
  if (composition.tele == nullptr) return all;
  const remote::TeleConfig& link = composition.experiment.teleoperation->link;
  const double silent_s = static_cast<double>(composition.tele->figures().silent_cycles) *
                          static_cast<double>(composition.experiment.loop.period_ns) * 1e-9;
  if (silent_s > 1.0 + 2.0 * link.down.delay_s) {
    all.push_back(fmt::format(
        "no state of the robot came in the last {:.3f} s: what the operator saw then was {}",
        silent_s, link.predict ? "the prediction alone" : "the last state"));
  }
  return all;
}

std::size_t RunSummary::never_injected() const { return due_after_end(composition, cycle).size(); }

}  // namespace tandem::apps
