#include "apps/run/past.hpp"

#include <fmt/core.h>

#include <utility>

#include "runtime/condition/condition.hpp"
#include "runtime/run/identity.hpp"

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

/// A state of theirs is in the memory of their process, and in no log.
bool Past::boards_are_elsewhere() const {
  return c_.experiment.hal.backend == runtime::BackendKind::kWire;
}

Status Past::check(const RunOptions& options) const {
  if (machine_ != nullptr && boards_are_elsewhere() && !options.from.empty()) {
    return fail_at("--from",
                   "this run cannot go on from a log: its boards are in another process, which "
                   "keeps their states in memory alone",
                   "leave it out, or run it with --hal sim");
  }
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

/// A state each so many cycles, of which there are not more than kMostStates. Of a run without an
/// end, or of one that cannot be saved whole, there is no trunk.
Status Past::write_trunk(const RunOptions& options) {
  const runtime::Experiment& e = c_.experiment;
  auto file = runtime::TrunkFile::open(options.trunk_file, c_.events.get());
  if (!file) return std::unexpected(file.error());
  trunk_ = std::move(*file);
  if (e.endless() || c_.parallel != nullptr) return {};
  const std::uint64_t apart = 1 + (e.cycles() + e.settle_cycles()) / runtime::kMostStates;
  machine_->log_to({.state = [this](const runtime::Checkpoint& one) { trunk_->add(one); }}, apart);
  return {};
}

/// In the last state of a trunk that fits; else from the beginning.
Status Past::begin_in(runtime::RobotCycle& cycle, const RunOptions& options) {
  const runtime::Experiment& e = c_.experiment;
  if (!cycle.unarchived().empty() || c_.parallel != nullptr) return {};
  const runtime::Checkpoint* from =
      runtime::branching_state(*options.trunk, e, options.later, c_.events.get());
  if (from == nullptr || from->cycle == 0) return {};
  const sim::FaultInjection own = c_.sim->robot().injection();
  if (Status begun = machine_->begin(cycle, *from, from->cycle); !begun) return begun;
  runtime::come_later(*c_.sim, own, e, options.later);
  begins_s_ = 1e-9 * static_cast<double>(e.loop.period_ns) * static_cast<double>(from->cycle - 1);
  return {};
}

Result<std::string> Past::begin(runtime::RobotCycle& cycle, log::Recorder* recorder,
                                const RunOptions& options) {
  if (machine_ == nullptr) return std::string();
  if (!options.trunk_file.empty()) {
    if (const Status written = write_trunk(options); !written)
      return std::unexpected(written.error());
  }
  if (options.trunk != nullptr) {
    if (const Status begun = begin_in(cycle, options); !begun)
      return std::unexpected(begun.error());
  }
  const std::int64_t period_ns = c_.experiment.loop.period_ns;
  if (recorder != nullptr && !boards_are_elsewhere()) {
    machine_->log_to(runtime::states_to(*recorder, period_ns));
  }
  if (!begins_) return std::string();
  const auto time_s = [period_ns](std::uint64_t next) {
    return 1e-9 * static_cast<double>(period_ns) * static_cast<double>(next == 0 ? 0 : next - 1);
  };
  begins_s_ = time_s(begins_->next);
  const std::uint64_t controllers = begins_->from.controllers;
  const Status there = machine_->begin(cycle, std::move(begins_->from), begins_->next);
  if (!there) {
    const auto other = runtime::difference_from(begins_->info, c_, cycle.config());
    if (other) return std::unexpected(*other);
    if (controllers != cycle.controllers())
      return fail(fmt::format("at {:.6g} s other controllers were loaded in {} than this run loads",
                              begins_s_, begins_->branch.of),
                  "go on from a moment before they came or went: tandem log csv LOG --topic event");
    return std::unexpected(there.error());
  }
  std::string line = fmt::format("goes on from {} at {:.6g} s", begins_->branch.of, begins_s_);
  if (begins_->next == begins_->asked) return line;
  return line + fmt::format(", not {:.6g} s: it heard something then, which cannot be played again",
                            time_s(begins_->asked));
}

void Past::finish() { trunk_.reset(); }

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
