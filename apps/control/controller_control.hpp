// What a running run can be asked for of its controllers.
// Layer: apps/control.  Thread: main; the handlers run on the serving thread.
#pragma once

#include <functional>
#include <string>

#include "apps/control/control_registry.hpp"
#include "runtime/run_services.hpp"

namespace tandem::apps {

/// A controller that is about to be loaded.
struct ControllerTrial {
  std::string name;
  std::string plugin;      ///< as load_controller() takes it
  std::string parameters;  ///< TOML
  std::string file;        ///< where that is from
  std::string table;       ///< the path of its parameters there; empty: all of it
};
/// Tries it where a crash does no harm. Errors: it must not be loaded.
using TryController = std::function<Status(const ControllerTrial&)>;

/// Adds "controller.list", "controller.load", "controller.reload", "controller.unload",
/// "controller.start", "controller.stop", "controller.switch" and those of shadows. Services and
/// robot outlive the registry.
/// @param trial  before a library is opened, unless the question says "untried"; empty: none is
void add_controller_commands(ControlRegistry& registry, runtime::RunServices& services,
                             const hal::RobotConfig& robot, TryController trial = {});

/// Error: one of these is the owner in another process, which nobody switches by hand.
[[nodiscard]] Status check_no_owner(runtime::RunServices& services,
                                    const std::vector<std::string>& names);

/// {"done": …, "cycle": …}: what became of a request.
[[nodiscard]] Json asked_json(const runtime::RequestResult& asked);

}  // namespace tandem::apps
