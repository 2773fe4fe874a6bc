#include "apps/remote_gate.hpp"

#include <fmt/core.h>

namespace tandem::apps {

ControlRegistry::Gate remote_gate(runtime::RemoteCommand command,
                                  std::function<std::string()> owner) {
  return [command, owner = std::move(owner)](const std::string& name,
                                             ControlEffect effect) -> Status {
    if (effect != ControlEffect::kChanges) return {};
    if (command == runtime::RemoteCommand::kOff) {
      return fail(name + ": this process takes no commands over DDS",
                  "[remote] command = \"local\" in its experiment allows them; its control socket "
                  "takes them on its own machine");
    }
    const bool of_the_robot = name.starts_with("controller.") || name.starts_with("joint.");
    const std::string who = of_the_robot && owner ? owner() : std::string();
    if (who.empty()) return {};
    return fail(fmt::format("{}: '{}' commands the robot", name, who),
                "wait until it releases the robot");
  };
}

}  // namespace tandem::apps
