#include "apps/run/inject.hpp"

#include <fmt/core.h>

#include <utility>

#include "hal/sim/scenario.hpp"

namespace tandem::apps {

void add_inject(ControlRegistry& registry, const hal::RobotConfig& robot, const model::Tree* tree,
                std::int64_t period_ns, std::function<Status(const sim::ScenarioFault&)> add) {
  registry.add(
      "inject",
      [&robot, tree, period_ns, add = std::move(add)](const Json& request) -> Result<Json> {
        const auto faults = sim::parse_scenario(request["scenario"].get<std::string>(), "inject",
                                                robot, period_ns, tree);
        if (!faults) return std::unexpected(faults.error().front());
        for (const sim::ScenarioFault& fault : *faults) {
          if (Status added = add(fault); !added) return std::unexpected(added.error());
        }
        return Json{{"injected", faults->size()}};
      });
}

Status injected(Code code) {
  if (code == Code::kOk) return {};
  if (code == Code::kOutOfRange) {
    return fail(
        "a board_duplicate, and the payload of another engine, have to be known when the "
        "robot is made",
        "put it into a scenario file: --scenario; a payload into [[sim.payload]]");
  }
  return fail(fmt::format("{} faults were injected already, the most that there can be",
                          sim::FaultInjection::kMostFaults),
              "start the robot again");
}

}  // namespace tandem::apps
