#include "apps/bench/engine_entries.hpp"

#include <algorithm>

#include "hal/sim/engine_loader.hpp"

namespace tandem::apps {
namespace {

using report::CurveStyle;

EngineEntry by_runge_kutta(EngineEntry entry, CurveStyle style) {
  entry.label += " rk4";
  entry.integrator = sim::Integrator::kRungeKutta4;
  entry.method = entry.ours() ? "Runge-Kutta, order 4"
                              : "Runge-Kutta, order 4; 2 of a base's turning, 1 where motors or "
                                "springs drive joints, whose torques it holds for a step";
  entry.style = style;
  return entry;
}

std::vector<EngineEntry> own() {
  EngineEntry first{.label = "tandem",
                    .engine = sim::kOwnEngine,
                    .version = "this build",
                    .method = "leapfrog, order 2",
                    .settings = "none",
                    .style = CurveStyle::kMeasured};
  return {first, by_runge_kutta(first, CurveStyle::kReference)};
}

}  // namespace

Result<std::vector<EngineEntry>> engine_entries(const std::vector<std::string>& names) {
  constexpr CurveStyle kStyles[] = {CurveStyle::kSecond, CurveStyle::kThird, CurveStyle::kFourth,
                                    CurveStyle::kFifth, CurveStyle::kSixth};
  std::vector<EngineEntry> entries = own();
  std::size_t style = 0;
  for (const std::string& name : names.empty() ? sim::installed_engines() : names) {
    if (name == sim::kOwnEngine || std::ranges::count(entries, name, &EngineEntry::engine) != 0)
      continue;
    const Result<const sim::EnginePlugin*> plugin = sim::load_engine(name);
    if (!plugin) {
      Error error = plugin.error();
      error.key = "--engines";
      return std::unexpected(std::move(error));
    }
    EngineEntry entry{.label = name,
                      .engine = name,
                      .version = (*plugin)->version,
                      .method = (*plugin)->integrator,
                      .settings = (*plugin)->settings,
                      .style = kStyles[style++ % std::size(kStyles)]};
    entries.push_back(entry);
    if ((*plugin)->rk4) entries.push_back(by_runge_kutta(entry, CurveStyle::kSecondDashed));
  }
  return entries;
}

}  // namespace tandem::apps
