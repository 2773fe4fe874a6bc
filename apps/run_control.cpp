#include "apps/run_control.hpp"

#include <fmt/core.h>

#include "apps/clock_control.hpp"
#include "apps/controller_control.hpp"
#include "apps/fault_table.hpp"
#include "apps/joint_control.hpp"

namespace tandem::apps {
namespace {

Json status(const runtime::RobotCycle& cycle) {
  const runtime::Progress& progress = cycle.progress();
  return {{"phase", runtime::to_string(progress.phase.load())},
          {"paused", time_stands(cycle)},
          {"cycles", progress.cycles.load()},
          {"running_cycles", progress.running_cycles.load()},
          {"total_cycles", progress.total_cycles.load()},
          {"overruns", progress.overruns.load()},
          {"dropped", progress.dropped.load()},
          {"latched", progress.latched.load()},
          {"resets", progress.resets.load()},
          {"failed_resets", progress.failed_resets.load()}};
}

Result<Json> reset(runtime::RobotCycle& cycle) {
  using runtime::RunPhase;
  const RunPhase phase = cycle.progress().phase.load();
  Json answer = status(cycle);
  if (cycle.progress().latched.load() == 0) return answer;  // nothing to do is no error
  if (phase == RunPhase::kBringUp || phase == RunPhase::kShutDown || phase == RunPhase::kDone) {
    return fail(fmt::format("the run is in the phase {}", runtime::to_string(phase)),
                "a fault is reset while the run waits for it: tandem run --on-fault wait");
  }
  cycle.requests().reset_faults();
  return answer;
}

Result<Json> stop(runtime::RobotCycle& cycle, const Json& request, hal::StopCategory category) {
  if (request.contains("category")) {
    const auto number = request["category"].get<std::int64_t>();
    if (number != 0 && number != 1) return fail("estop: \"category\" is not 0 or 1");
    category = number == 0 ? hal::StopCategory::kCategory0 : hal::StopCategory::kCategory1;
  }
  cycle.requests().emergency_stop(category);
  return Json{{"category", hal::to_string(category)}, {"paused", time_stands(cycle)}};
}

}  // namespace

void add_run_commands(ControlRegistry& registry, runtime::RobotCycle& cycle,
                      const hal::RobotConfig& robot) {
  registry.add("status", ControlEffect::kReads, "phase and counts of the run", {},
               [&cycle](const Json&) -> Result<Json> { return status(cycle); });
  registry.add("fault.show", ControlEffect::kReads, "every fault of the run, latched or cleared",
               {}, [&cycle](const Json&) -> Result<Json> {
                 Json answer = status(cycle);
                 answer["faults"] = faults_json(cycle.faults());
                 answer["lost"] = cycle.fault_log().lost();
                 return answer;
               });
  registry.add("fault.reset", ControlEffect::kChanges,
               "clears what is latched; resets or failed_resets counts on when done", {},
               [&cycle](const Json&) { return reset(cycle); });
  registry.add(
      "estop", ControlEffect::kStops, "emergency stop, latched",
      {{.name = "category",
        .type = ControlKey::Type::kInteger,
        .doc = "0 or 1; else what robot.toml's [safety] says"}},
      [&cycle, &robot](const Json& request) { return stop(cycle, request, robot.emergency_stop); });
  registry.add("run.stop", ControlEffect::kChanges, "ends the run in order", {},
               [&cycle](const Json&) -> Result<Json> {
                 cycle.requests().end_run();
                 return Json::object();
               });
  add_controller_commands(registry, cycle.services(), robot);
  add_joint_commands(registry, cycle.services());
  add_clock_commands(registry, cycle);
}

Result<std::unique_ptr<ControlSocket>> serve(const ControlRegistry& registry,
                                             const ControlSocketOptions& options) {
  if (!options.wanted) return nullptr;
  const std::string& path = options.path;
  auto socket = ControlSocket::open(path.empty() ? default_control_path(options.kind) : path,
                                    registry);
  if (socket) return socket;
  if (options.needed) {
    return fail("`tandem estop` would not reach this robot: " + socket.error().message,
                socket.error().hint);
  }
  fmt::print(stderr, "note: no control socket: {}\n", socket.error().to_string());
  return nullptr;
}

}  // namespace tandem::apps
