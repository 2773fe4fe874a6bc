#include "runtime/run/late_plans.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <iterator>
#include <vector>

namespace tandem::runtime {

Diagnostics late_plans(const Composition& c) {
  Diagnostics warnings;
  const Experiment& e = c.experiment;
  const double end_s = e.duration_s + 0.5e-9 * static_cast<double>(e.loop.period_ns);
  for (const auto& one : c.controllers->owned()) {
    const auto spec = one == nullptr
                          ? e.controllers.end()
                          : std::ranges::find(e.controllers, one->name, &ControllerSpec::name);
    if (spec == e.controllers.end() || !spec->active) continue;  // others start later
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
