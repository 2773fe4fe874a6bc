// Who takes part in a comparison of engines.
// Layer: apps/bench.  Thread: main.
#pragma once

#include <string>
#include <vector>

#include "base/result.hpp"
#include "hal/sim/plant.hpp"
#include "report/figure.hpp"

namespace tandem::apps {

/// An engine with an integrator. Tandem's own takes part with both of its.
struct EngineEntry {
  std::string label;   ///< "tandem rk4"
  std::string engine;  ///< as `[sim] engine`
  sim::Integrator integrator = sim::Integrator::kLeapfrog;
  std::string version, method, settings;                     ///< in words
  report::CurveStyle style = report::CurveStyle::kMeasured;  ///< of its curves

  [[nodiscard]] bool ours() const { return engine == sim::kOwnEngine; }
};

/// Tandem's own engine, and those of `names`; all that are installed when `names` is empty.
/// Errors: those of load_engine().
[[nodiscard]] Result<std::vector<EngineEntry>> engine_entries(
    const std::vector<std::string>& names);

}  // namespace tandem::apps
