#include "apps/run_control.hpp"

#include <fmt/core.h>

namespace tandem::apps {
namespace {

Json status(const runtime::Progress& progress) {
  return {{"phase", runtime::to_string(progress.phase.load())},
          {"cycles", progress.cycles.load()},
          {"running_cycles", progress.running_cycles.load()},
          {"total_cycles", progress.total_cycles.load()},
          {"overruns", progress.overruns.load()},
          {"dropped", progress.dropped.load()}};
}

}  // namespace

void add_run_commands(ControlRegistry& registry, const runtime::RobotCycle& cycle) {
  registry.add(
      "status", "phase and counts of the run", {},
      [&progress = cycle.progress()](const Json&) -> Result<Json> { return status(progress); });
}

std::unique_ptr<ControlSocket> serve(const ControlRegistry& registry, const std::string& path,
                                     const std::string& kind) {
  auto socket = ControlSocket::open(path.empty() ? default_control_path(kind) : path, registry);
  if (socket) return std::move(*socket);
  fmt::print(stderr, "note: no control socket: {}\n", socket.error().to_string());
  return nullptr;
}

}  // namespace tandem::apps
