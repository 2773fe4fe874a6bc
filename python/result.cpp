// Figures and faults of a run, by the names of `tandem run --json` (docs/json.md).
// Layer: python.  Thread: as python/running.hpp.
#include <algorithm>

#include "apps/control/fault_table.hpp"
#include "apps/control/run_figures.hpp"
#include "hal/sim/plant_changes.hpp"
#include "python/running.hpp"
#include "runtime/run/plant_weight.hpp"

namespace tandem::python {
namespace {

/// How it ended; null: it goes on.
apps::Json ended_of(const Running& running) {
  if (!running.over()) return {};
  const runtime::RobotCycle& cycle = running.run().cycle();
  const std::uint64_t planned = running.run().experiment().cycles();
  const auto latched = [](const runtime::FaultReport& one) { return one.latched; };
  if (std::ranges::any_of(cycle.faults(), latched)) return "by a fault";
  if (planned > 0 && cycle.running_cycles() >= planned) return "as planned";
  return cycle.inbox().bell().ended() ? "on request" : "its controllers were done";
}

}  // namespace

py::list faults_of(const Running& running) {
  py::list out;
  for (const runtime::FaultReport& one : running.run().cycle().faults()) {
    py::dict fault;
    fault["time_s"] = one.time_s;
    fault["cycle"] = one.cycle;
    fault["joint"] = one.joint;
    fault["board"] = one.board;
    fault["text"] = one.text;
    fault["category"] = static_cast<int>(one.category);
    fault["latched"] = one.latched;
    out.append(std::move(fault));
  }
  return out;
}

std::string Running::result() {
  const Turn turn(*this);
  const runtime::Experiment& e = c_->experiment;
  const apps::RunFigures figures{.experiment = &e,
                                 .cycle = &run().cycle(),
                                 .controllers = c_->controllers.get(),
                                 .ground = runtime::ground_of(*c_, run().cycle()),
                                 .kernel_variant = c_->kernels->variant,
                                 .expectations = run().expectations()};
  apps::Json json = apps::figures_json(&figures);
  json["ended"] = ended_of(*this);
  json["plant"] = e.plant != nullptr ? apps::Json(e.plant->differences) : apps::Json();
  json["faults"] = apps::latched_texts(run().cycle().faults());
  return json.dump(-1, ' ', false, apps::Json::error_handler_t::replace);
}

}  // namespace tandem::python
