#include "runtime/run/late_plans.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <iterator>
#include <vector>

namespace tandem::runtime {
namespace {

/// Rows that arrive after the run's end.
void add_late_rows(const InputPort& port, const Experiment& e, Diagnostics& warnings) {
  const InputPlan& plan = port.plan();
  if (plan.number.empty() || e.endless()) return;
  const auto late = std::ranges::upper_bound(plan.at, e.cycles());
  if (late == plan.at.end()) return;
  const auto at_s = [&](std::uint64_t cycle) {
    return 1e-9 * static_cast<double>(cycle) * static_cast<double>(e.loop.period_ns);
  };
  const auto first = static_cast<std::size_t>(late - plan.at.begin());
  const std::size_t more = plan.at.size() - first - 1;
  const bool is_file = port.source().feeder == InputFeeder::kFile;
  Error warning = port.source().where;
  if (is_file) {
    warning = {.message = {},
               .hint = {},
               .file = port.source().file,
               .line = static_cast<int>(plan.number[first]),
               .key = {}};
  }
  warning.message = fmt::format(
      "{} of the input '{}' arrives {:g} s after the start of '{}'{}; the run ends after {:g} s",
      is_file ? "this row" : fmt::format("row {} of the timeline", plan.number[first]),
      port.input().name, at_s(*late), port.controller(),
      more == 0 ? "" : fmt::format(", and {} more later", more), e.duration_s);
  warning.hint = fmt::format("duration_s = {:g} or more, or leave out what does not arrive",
                             at_s(plan.at.back()));
  warnings.push_back(std::move(warning));
}

}  // namespace

Diagnostics empty_plans(const Composition& c) {
  Diagnostics warnings;
  if (c.controllers == nullptr) return warnings;
  for (const auto& one : c.controllers->owned()) {
    if (one == nullptr) continue;
    for (const auto& port : one->inputs) {
      const InputFeeder feeder = port->source().feeder;
      const bool is_file = feeder == InputFeeder::kFile;
      if ((!is_file && feeder != InputFeeder::kTimeline) || !port->plan().at.empty()) continue;
      Error& warning = warnings.emplace_back(port->source().where);
      warning.message = fmt::format("the {} of the input '{}' has no row: nothing arrives",
                                    is_file ? "file" : "timeline", port->input().name);
      warning.hint = "write timeline = [[0.5, …], …]: seconds, then the components";
      if (!is_file) continue;
      warning.file = port->source().file;
      warning.line = 0;
      warning.key.clear();
      warning.hint = warning.file.ends_with(".mcap")
                         ? "name a log in which samples of this input arrived"
                         : "write a row for each sample: seconds, then the components";
    }
  }
  return warnings;
}

Diagnostics late_plans(const Composition& c) {
  Diagnostics warnings;
  const Experiment& e = c.experiment;
  const double end_s = e.duration_s + 0.5e-9 * static_cast<double>(e.loop.period_ns);
  for (const auto& one : c.controllers->owned()) {
    const auto spec = one == nullptr
                          ? e.controllers.end()
                          : std::ranges::find(e.controllers, one->name, &ControllerSpec::name);
    if (spec == e.controllers.end() || !spec->active) continue;  // others start later
    for (const auto& port : one->inputs) add_late_rows(*port, e, warnings);
    std::vector<ControllerSetup::Plan> late;
    std::ranges::copy_if(one->plans, std::back_inserter(late),
                         [&](const auto& plan) { return plan.time_s > end_s; });
    if (late.empty()) continue;
    const auto by_time = std::ranges::minmax(late, {}, &ControllerSetup::Plan::time_s);
    const std::size_t more = late.size() - 1;
    Error warning = by_time.min.where;
    warning.message = fmt::format(
        "the controller '{}' reaches this {:g} s after its start{}; the run ends after "
        "{:g} s",
        one->name, by_time.min.time_s, more == 0 ? "" : fmt::format(", and {} more later", more),
        e.duration_s);
    warning.hint = fmt::format("duration_s = {:g} or more, or leave out what is not reached",
                               by_time.max.time_s);
    warnings.push_back(std::move(warning));
  }
  return warnings;
}

}  // namespace tandem::runtime
