#include "apps/run/past.hpp"

#include <fmt/core.h>

#include <utility>

#include "runtime/condition/condition.hpp"

namespace tandem::apps {
namespace {

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

Past::Past(const runtime::Composition& composition, const RunOptions& options)
    : c_(composition), why_not_(runtime::why_no_past(composition)) {
  if (!why_not_.empty()) return;
  const rt::CyclicLoopConfig& loop = composition.experiment.loop;
  const bool useful = options.rate.value_or(loop.rate) > 0.0 || options.start_paused ||
                      loop.start_paused || options.studio.wanted;
  machine_ = std::make_unique<runtime::TimeMachine>(
      loop.period_ns, options.checkpoints_bytes.value_or(runtime::TimeMachine::kBudget_bytes),
      options.checkpoints_bytes ? *options.checkpoints_bytes > 0 : useful);
}

Status Past::check(const RunOptions& options) const {
  if (machine_ != nullptr) return {};
  const std::string why = "this run cannot go back in time: " + why_not_;
  if (options.checkpoints_bytes.value_or(0) > 0) {
    return fail_at("--checkpoints", why, "leave it out");
  }
  return options.from.empty() ? Status() : fail_at("--from", why, "leave it out");
}

Status Past::read_beginning(const RunOptions& options) {
  if (options.from.empty()) return {};
  const auto moment = runtime::LogMoment::read(options.from);
  if (!moment) return std::unexpected(moment.error());
  auto begins = runtime::beginning_at(*moment);
  if (!begins) return std::unexpected(begins.error());
  begins_ = std::move(*begins);
  return {};
}

Result<std::string> Past::begin(runtime::RobotCycle& cycle, log::Recorder* recorder) {
  if (machine_ == nullptr) return std::string();
  const std::int64_t period_ns = c_.experiment.loop.period_ns;
  if (recorder != nullptr) {
    machine_->log_to([recorder, period_ns](const runtime::Checkpoint& one) {
      runtime::log_state(*recorder, one, period_ns);
    });
  }
  if (!begins_) return std::string();
  const Status there = machine_->begin(cycle, std::move(begins_->from), begins_->next);
  if (!there) return std::unexpected(there.error());
  const auto time_s = [period_ns](std::uint64_t next) {
    return 1e-9 * static_cast<double>(period_ns) * static_cast<double>(next == 0 ? 0 : next - 1);
  };
  std::string line =
      fmt::format("goes on from {} at {:.6g} s", begins_->branch.of, time_s(begins_->next));
  if (begins_->next == begins_->asked) return line;
  return line + fmt::format(", not {:.6g} s: it heard something then, which cannot be played again",
                            time_s(begins_->asked));
}

void Past::finish() {
  if (machine_ != nullptr) machine_->finish();
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
