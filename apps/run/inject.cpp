#include "apps/run/inject.hpp"

#include <fmt/core.h>

#include <utility>

#include "hal/sim/scenario.hpp"

namespace tandem::apps {
namespace {

/// Reads all of `scenario`, and adds it.
Result<Json> add_all(const std::string& scenario, const std::string& what,
                     const hal::RobotConfig& robot, const model::Tree* tree, std::int64_t period_ns,
                     const AddFault& add) {
  const auto faults = sim::parse_scenario(scenario, what, robot, period_ns, tree);
  if (!faults) return std::unexpected(faults.error().front());
  for (const sim::ScenarioFault& fault : *faults) {
    if (Status added = add(fault); !added) return std::unexpected(added.error());
  }
  return Json{{"injected", faults->size()}};
}

}  // namespace

std::string scenario_of(const Json& request) {
  if (request["do"] == "inject") return request["scenario"].get<std::string>();
  std::string text = "[[push]]\n";
  for (const auto& [key, value] : request.items())
    if (key != "do") text += key + " = " + value.dump() + "\n";
  return text;
}

void add_push(ControlRegistry& registry, const hal::RobotConfig& robot, const model::Tree* tree,
              std::int64_t period_ns, AddFault add) {
  registry.add("push",
               [&robot, tree, period_ns, add = std::move(add)](const Json& row) -> Result<Json> {
                 if (!add) {
                   return fail("this robot is not simulated in this process: nobody can push it",
                               "run it with --hal sim; the robot of `tandem emulate` is pushed by "
                               "tandem inject kind=push …");
                 }
                 return add_all(scenario_of(row), "push", robot, tree, period_ns, add);
               });
}

void add_inject(ControlRegistry& registry, const hal::RobotConfig& robot, const model::Tree* tree,
                std::int64_t period_ns, AddFault add) {
  registry.add(
      "inject",
      [&robot, tree, period_ns, add = std::move(add)](const Json& request) -> Result<Json> {
        return add_all(scenario_of(request), "inject", robot, tree, period_ns, add);
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
  return fail(fmt::format("there is no room for another one: at most 16 a cycle, and {} in all; "
                          "pushes that are over do not count",
                          sim::FaultInjection::kMostFaults),
              "let time go on for a cycle; where all are taken, start the robot again");
}

}  // namespace tandem::apps
