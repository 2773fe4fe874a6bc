#include "apps/control/remote_gate.hpp"

#include <fmt/core.h>

namespace tandem::apps {

namespace {

Status check_load(bool allowed, const Json& request) {
  if (!allowed) {
    return fail("controller.load: this process loads no code over DDS",
                "[remote] load = true in its experiment allows controllers of its folders; its "
                "control socket takes them on its own machine");
  }
  const auto plugin = request.find("plugin");
  const bool path = plugin != request.end() && plugin->is_string() &&
                    plugin->get<std::string>().find('/') != std::string::npos;
  if (!path) return {};
  return fail("controller.load: a path is not taken over DDS",
              "name a controller of the process' own folders (TANDEM_CONTROLLERS)");
}

}  // namespace

ControlRegistry::Gate remote_gate(const runtime::RemoteOptions& remote,
                                  std::function<std::string()> owner) {
  const auto command = remote.command.value_or(runtime::RemoteAccess::kOff);
  return [command, load = remote.load, owner = std::move(owner)](
             const std::string& name, ControlEffect effect, const Json& request) -> Status {
    if (!is_guarded(effect)) return {};
    if (name == "studio.open") {
      return fail("studio.open: the studio's token is not given away over DDS",
                  "say `tandem studio` on the run's own machine");
    }
    if (command == runtime::RemoteAccess::kOff) {
      return fail(name + ": this process takes no commands over DDS",
                  "[remote] command = \"local\" in its experiment allows them; its control socket "
                  "takes them on its own machine");
    }
    if (name == "controller.load") {
      if (const Status loads = check_load(load, request); !loads) return loads;
    }
    const bool of_the_robot =
        name.starts_with("controller.") || name.starts_with("joint.") || name.starts_with("input.");
    const std::string who = of_the_robot && owner ? owner() : std::string();
    if (who.empty()) return {};
    return fail(fmt::format("{}: '{}' commands the robot", name, who),
                "wait until it releases the robot");
  };
}

}  // namespace tandem::apps
