#include "apps/control/controller_control.hpp"

#include <algorithm>
#include <filesystem>

#include "apps/text/toml_text.hpp"
#include "controllers/hosted_call.hpp"
#include "controllers/plugin_loader.hpp"
#include "runtime/controller_host.hpp"
#include "runtime/owner_controller.hpp"

namespace tandem::apps {
namespace {

using runtime::RunServices;
using Names = std::vector<std::string>;

Json list(RunServices& services, const hal::RobotConfig& robot) {
  Json all = Json::array();
  for (const runtime::ControllerStatus& one : services.controllers()) {
    Json claims = Json::array();
    for (const auto& claim : one.claims) {
      claims.push_back({{"joint", robot.joints[claim.joint].name},
                        {"mode", hal::to_string(claim.mode)},
                        {"interaction", hal::to_string(claim.interaction)}});
    }
    all.push_back({{"name", one.name},
                   {"plugin", one.plugin},
                   {"active", one.active},
                   {"finished", one.done},
                   {"of_experiment", one.of_experiment},
                   {"call_ns", one.call_ns.max == 0 ? Json() : percentiles_json(one.call_ns)},
                   {"overruns", one.overruns},
                   {"claims", std::move(claims)}});
  }
  return all;
}

/// Why controllers that were selected do not run yet; empty: they do.
std::string starts_later(hal::RunPhase phase) {
  switch (phase) {
    case hal::RunPhase::kBringUp:
    case hal::RunPhase::kSettling: return "not started yet: they start when the robot is ready";
    case hal::RunPhase::kFaulted:
      return "not started yet: a fault is latched. `tandem fault reset`, then `tandem controller "
             "start`, which after_reset = \"continue\" spares";
    case hal::RunPhase::kResetting:
      return "not started yet: a reset is under way. Then `tandem controller start`, which "
             "after_reset = \"continue\" spares";
    case hal::RunPhase::kRunning:
    case hal::RunPhase::kHeld:
    case hal::RunPhase::kRetreating:
    case hal::RunPhase::kShutDown:
    case hal::RunPhase::kDone: break;
  }
  return {};
}

/// What was done, and who is active now.
Result<Json> tell(RunServices& services, const Result<runtime::RequestResult>& asked) {
  if (!asked) return std::unexpected(asked.error());
  Json answer = asked_json(*asked);
  answer["active"] = Json::array();
  for (const runtime::ControllerStatus& one : services.controllers()) {
    if (one.active) answer["active"].push_back(one.name);
  }
  return answer;
}

/// A switch that an operator asks for. The owner in another process comes and goes with its lease.
Result<Json> switch_by_hand(RunServices& services, const Names& stop, const Names& start) {
  for (const runtime::ControllerStatus& one : services.controllers()) {
    if (one.name != runtime::kOwnerController || !one.plugin.empty()) continue;
    const auto named = std::ranges::count(stop, one.name) + std::ranges::count(start, one.name);
    if (named == 0) continue;
    return fail("'" + one.name + "' is the owner in another process: it comes and goes by itself",
                "end the owner's run; `tandem estop` stops the robot in any case");
  }
  const auto asked = services.switch_controllers(stop, start);
  auto answer = tell(services, asked);
  if (!answer || !asked->done || start.empty()) return answer;
  const std::string later = starts_later(asked->phase);
  if (!later.empty()) (*answer)["note"] = later;
  return answer;
}

Result<TomlDocument> parameters_of(const Json& request) {
  const auto found = request.find("parameters");
  const std::string file = request.value("parameters_file", "parameters");
  if (found == request.end()) return TomlDocument::parse("", file);
  const Result<std::string> text =
      found->is_string() ? Result<std::string>(found->get<std::string>()) : toml_of(*found);
  if (!text) return std::unexpected(text.error());
  auto document = TomlDocument::parse(*text, file);
  if (document) return document;
  const Error& error = document.error();
  return fail(file + ":" + std::to_string(error.line) + ": " + error.message, error.hint);
}

Result<Json> load(RunServices& services, const Json& request) {
  const auto plugin = request["plugin"].get<std::string>();
  const std::string name = request.value("name", std::filesystem::path(plugin).stem().string());
  const auto parameters = parameters_of(request);
  if (!parameters) return std::unexpected(parameters.error());
  auto loaded = bounded_call(name, runtime::ControllerHost::kConfigureTime,
                             [plugin] { return load_controller(plugin, controller_folders()); });
  if (!loaded) return std::unexpected(loaded.error());
  Json what{{"name", name}, {"doc", loaded->plugin().doc}};
  auto answer = tell(services, services.load(name, std::move(*loaded), *parameters));
  if (answer) answer->update(what);
  return answer;
}

/// Why it did not take over its former build's state; empty: it did.
const char* why_afresh(runtime::Kept kept) {
  switch (kept) {
    case runtime::Kept::kState: break;
    case runtime::Kept::kNotWanted: return "that was asked for";
    case runtime::Kept::kNoArchive: return "it has members, and no archive()";
    case runtime::Kept::kOtherClaims: return "it claims other joints or modes than before";
    case runtime::Kept::kOtherState: return "what its archive() names has another size than before";
  }
  return "";
}

Result<Json> reload(RunServices& services, const Json& request) {
  const auto name = request["name"].get<std::string>();
  const auto made = services.reload(name, request.value("fresh", false));
  if (!made) return std::unexpected(made.error());
  auto answer = tell(services, made->asked);
  if (!answer) return answer;
  answer->update({{"name", name}, {"changed", made->changed}});
  if (!made->asked.done) return answer;
  (*answer)["carried"] = made->kept == runtime::Kept::kState;
  (*answer)["afresh"] = why_afresh(made->kept);
  return answer;
}

Names names_of(const Json& request, const char* key) {
  return request.contains(key) ? request[key].get<Names>() : Names{};
}

}  // namespace

Json asked_json(const runtime::RequestResult& asked) {
  if (asked.done) return {{"done", true}, {"cycle", asked.cycle}};
  return {{"done", false}, {"note", "asked for; it will happen in the loop's next cycle"}};
}

void add_controller_commands(ControlRegistry& registry, RunServices& services,
                             const hal::RobotConfig& robot) {
  registry.add("controller.list", [&services, &robot](const Json&) -> Result<Json> {
    return Json{{"controllers", list(services, robot)}};
  });
  registry.add("controller.load",
               [&services](const Json& request) { return load(services, request); });
  registry.add("controller.reload",
               [&services](const Json& request) { return reload(services, request); });
  registry.add("controller.unload", [&services](const Json& request) {
    return tell(services, services.unload(request["name"].get<std::string>()));
  });
  registry.add("controller.start", [&services](const Json& request) {
    if (!request.contains("name")) return tell(services, services.go_on());
    const Names names{request["name"].get<std::string>()};
    return switch_by_hand(services, {}, names);
  });
  registry.add("controller.stop", [&services](const Json& request) {
    const Names names{request["name"].get<std::string>()};
    return switch_by_hand(services, names, {});
  });
  registry.add("controller.switch", [&services](const Json& request) {
    return switch_by_hand(services, names_of(request, "stop"), names_of(request, "start"));
  });
}

}  // namespace tandem::apps
