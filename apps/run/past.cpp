#include "apps/run/past.hpp"

#include <utility>

#include "runtime/condition/condition.hpp"

namespace tandem::apps {
namespace {

/// Why the run cannot go back; empty: it can.
std::string obstacle(const runtime::Composition& c, bool served) {
  if (c.backend->pace() != hal::Pace::kSimulatedClock) return "its time is real";
  if (c.sim == nullptr) return "its boards are in another process";
  if (served) return "another process may own its robot";
  if (c.parallel != nullptr) return "the second robot of [parallel] would not go with it";
  if (c.predictor != nullptr && c.predictor->is_prepared()) {
    return "a controller acts on predictions, which are not kept";
  }
  return {};
}

Result<runtime::Condition> read_condition(const runtime::Composition& c,
                                          const runtime::RobotCycle& cycle,
                                          runtime::RunServices& services, const std::string& text) {
  const hal::Robot robot = hal::robot_of(c.experiment.robot);
  const hal::TruthImage* truth = runtime::truth_of(c);
  runtime::QuantityNames names{
      .robot = robot,
      .state = cycle.state().layout(),
      .command = cycle.command().layout(),
      .truth = truth == nullptr ? nullptr : &truth->layout(),
      .estimate = c.estimator == nullptr ? nullptr : &c.estimator->image().layout()};
  for (const runtime::ControllerSignals& one : services.signals()) {
    names.signals.push_back({one.controller, one.block});
  }
  return runtime::Condition::read(text, names);
}

}  // namespace

Past::Past(const runtime::Composition& composition, const RunOptions& options, bool served)
    : c_(composition), why_not_(obstacle(composition, served)) {
  if (!why_not_.empty()) return;
  const rt::CyclicLoopConfig& loop = composition.experiment.loop;
  const bool useful = options.rate.value_or(loop.rate) > 0.0 || options.start_paused ||
                      loop.start_paused || options.studio.wanted;
  machine_ = std::make_unique<runtime::TimeMachine>(
      loop.period_ns, options.checkpoints_bytes.value_or(runtime::TimeMachine::kBudget_bytes),
      options.checkpoints_bytes ? *options.checkpoints_bytes > 0 : useful);
}

Status Past::check(const RunOptions& options) const {
  if (machine_ != nullptr || options.checkpoints_bytes.value_or(0) == 0) return {};
  return fail_at("--checkpoints", "this run cannot go back in time: " + why_not_, "leave it out");
}

RunPast Past::of(runtime::RobotCycle& cycle) {
  return {.machine = machine_.get(),
          .why_not = why_not_,
          .condition = [this, &cycle](const std::string& text) -> Result<runtime::CycleCondition> {
            auto read = read_condition(c_, cycle, cycle.services(), text);
            if (!read) return std::unexpected(read.error());
            return runtime::CycleCondition([holds = std::move(*read)](const hal::CycleView& view) {
              return holds.holds(view);
            });
          }};
}

}  // namespace tandem::apps
