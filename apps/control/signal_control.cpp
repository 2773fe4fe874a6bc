#include "apps/control/signal_control.hpp"

#include <span>

namespace tandem::apps {
namespace {

Json signals_json(runtime::RunServices& services, const hal::RobotConfig& robot) {
  std::vector<std::string> joints;
  for (const hal::JointConfig& joint : robot.joints) joints.push_back(joint.name);
  Json all = Json::array();
  for (const runtime::ControllerSignals& of : services.signals()) {
    const hal::SignalBlock::Look look = of.block->look();
    const std::vector<std::string> names = of.block->number_names(joints);
    for (const hal::SignalInfo& one : of.block->declared()) {
      Json values = Json::array();  // null: no number
      for (std::size_t i = 0; i < one.count; ++i) {
        values.push_back(look.values.empty() ? Json() : Json(look.values[one.first + i]));
      }
      const auto begin = names.begin() + static_cast<std::ptrdiff_t>(one.first);
      all.push_back({{"signal", of.controller + "." + one.name},
                     {"controller", of.controller},
                     {"active", of.active},
                     {"unit", one.unit},
                     {"doc", one.doc},
                     {"cycle", look.time_ns < 0 ? Json() : Json(look.cycle)},
                     {"time_s", look.time_ns < 0 ? Json() : Json(1e-9 * double(look.time_ns))},
                     {"names", std::vector<std::string>(
                                   begin, begin + static_cast<std::ptrdiff_t>(one.count))},
                     {"values", std::move(values)}});
    }
  }
  return {{"signals", std::move(all)}};
}

}  // namespace

void add_signal_commands(ControlRegistry& registry, runtime::RunServices& services,
                         const hal::RobotConfig& robot) {
  registry.add("signal.list", [&services, &robot](const Json&) -> Result<Json> {
    return signals_json(services, robot);
  });
}

}  // namespace tandem::apps
