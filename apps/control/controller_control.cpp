#include "apps/control/controller_control.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "apps/control/lenient_switch.hpp"
#include "apps/control/shadow_control.hpp"
#include "apps/text/toml_text.hpp"
#include "base/nearest.hpp"
#include "base/utf8.hpp"
#include "controllers/hosted_call.hpp"
#include "controllers/plugin_loader.hpp"
#include "runtime/controller_host.hpp"
#include "runtime/owner_controller.hpp"

namespace tandem::apps {
namespace {

using runtime::RunServices;
using Names = std::vector<std::string>;

Json value_json(const runtime::ParameterStatus& one, double value) {
  if (std::isnan(value)) return nullptr;
  if (one.type == ParameterType::kBoolean) return value == 1.0;
  if (one.type == ParameterType::kInteger) return static_cast<std::int64_t>(value);
  if (one.type == ParameterType::kNumber) return value;
  const auto index = static_cast<std::size_t>(value);
  return index < one.facts.choices.size() ? Json(one.facts.choices[index]) : Json(nullptr);
}

Json parameter_json(const runtime::ParameterStatus& one) {
  const ParameterFacts& facts = one.facts;
  const bool ranged = one.type <= ParameterType::kInteger;
  const auto limit = [ranged](double value, double none) {
    return ranged && value != none ? Json(value) : Json(nullptr);
  };
  return {{"name", one.name},
          {"type", to_string(one.type)},
          {"elements", Json::array()},
          {"unit", facts.unit},
          {"min", limit(facts.min, kAnyNumber.min)},
          {"above_min", facts.above_min},
          {"max", limit(facts.max, kAnyNumber.max)},
          {"choices", facts.choices},
          {"required", facts.otherwise.is == ParameterValue::Is::kNothing},
          {"default", value_json(one, one.otherwise)},
          {"value", value_json(one, one.value)},
          {"live", facts.live},
          {"doc", facts.doc}};
}

/// A list is one entry, with what its elements differ in as lists.
Json parameters_json(const std::vector<runtime::ParameterStatus>& parameters) {
  Json all = Json::array();
  std::string list;
  for (const runtime::ParameterStatus& one : parameters) {
    Json json = parameter_json(one);
    if (one.list.empty() || one.list != list) all.push_back(json);
    list = one.list;
    if (list.empty()) continue;
    Json& of = all.back();
    for (const char* key : {"min", "max", "default", "value"}) {
      if (of["name"] == one.name) of[key] = Json::array();
      of[key].push_back(json[key]);
    }
    if (of["name"] == one.name) of["name"] = list;
    of["type"] = "numbers";
    of["elements"].push_back(one.name.substr(list.size() + 1));
  }
  return all;
}

/// @param name  of the only one; empty: all
Json list(RunServices& services, const hal::RobotConfig& robot, const std::string& name = "") {
  Json all = Json::array();
  for (const runtime::ControllerStatus& one : services.controllers()) {
    if (!name.empty() && one.name != name) continue;
    Json claims = Json::array();
    for (const auto& claim : one.claims) {
      claims.push_back({{"joint", robot.joints[claim.joint].name},
                        {"mode", hal::to_string(claim.mode)},
                        {"interaction", hal::to_string(claim.interaction)}});
    }
    all.push_back({{"name", one.name},
                   {"plugin", one.plugin},
                   {"active", one.active},
                   {"shadow", one.shadow},
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

/// A switch at once, all or none.
Result<Json> switch_now(RunServices& services, const Names& stop, const Names& start) {
  const auto asked = services.switch_controllers(stop, start);
  auto answer = tell(services, asked);
  if (!answer || !asked->done || start.empty()) return answer;
  const std::string later = starts_later(asked->phase);
  if (!later.empty()) (*answer)["note"] = later;
  return answer;
}

/// A switch that an operator asks for.
Result<Json> switch_by_hand(RunServices& services, const hal::RobotConfig& robot, const Names& stop,
                            const Names& start, const Json& request) {
  for (const Names& names : {stop, start}) {
    if (const Status own = check_no_owner(services, names); !own)
      return std::unexpected(own.error());
  }
  if (request.value("cancel", false)) {
    if (!stop.empty() || !start.empty() || request.contains("when_within"))
      return fail_at("cancel", "is for the switch that waits, whatever that is", "give it alone");
    return tell(services, services.cancel_switch());
  }
  if (request.contains("when_within")) {
    if (request.contains("strictness"))
      return fail_at("strictness", "is for a switch at once", "leave it or when_within out");
    auto answer = tell(services, switch_when(services, robot, stop, start, request));
    if (answer) (*answer)["waits"] = true;
    return answer;
  }
  for (const char* const key : {"timeout_s", "unit"}) {
    if (request.contains(key))
      return fail_at(key, "is for a switch that waits", "give when_within, too");
  }
  const std::string strictness = request.value("strictness", "strict");
  if (strictness == "strict") return switch_now(services, stop, start);
  const std::vector<runtime::ControllerStatus> all = services.controllers();
  if (strictness == "force") {
    const Names more = with_who_is_in_the_way(all, stop, start);
    if (const Status own = check_no_owner(services, more); !own)
      return std::unexpected(own.error());
    return switch_now(services, more, start);
  }
  const LenientSwitch is = best_effort(all, stop, start);
  if (!is.some) return switch_now(services, stop, start);  // which says why not
  auto answer = is.stop.empty() && is.start.empty()
                    ? tell(services, runtime::RequestResult{.done = true})
                    : switch_now(services, is.stop, is.start);
  if (!answer || is.left_out.empty()) return answer;
  const std::string note = answer->value("note", std::string());
  (*answer)["note"] = (note.empty() ? "" : note + "; ") + left_out_text(is);
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

Result<Json> load(RunServices& services, const TryController& trial, const Json& request) {
  const auto plugin = request["plugin"].get<std::string>();
  const std::string name = request.value("name", std::filesystem::path(plugin).stem().string());
  const auto parameters = parameters_of(request);
  if (!parameters) return std::unexpected(parameters.error());
  if (trial && !request.value("untried", false)) {
    const Status tried = trial({.name = name,
                                .plugin = plugin,
                                .parameters = parameters->text(),
                                .file = parameters->file(),
                                .table = {}});
    if (!tried) return std::unexpected(tried.error());
  }
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

Result<Json> reload(RunServices& services, const TryController& trial, const Json& request) {
  const auto name = request["name"].get<std::string>();
  const auto as = services.loaded_as(name);
  if (!as) return std::unexpected(as.error());
  if (trial && !as->library.empty() && !request.value("untried", false)) {
    const bool is_path = as->library.find('/') != std::string::npos;
    const Status tried = trial({.name = name,
                                .plugin = is_path ? as->library : "./" + as->library,
                                .parameters = as->parameters,
                                .file = as->file,
                                .table = as->table});
    if (!tried) return std::unexpected(tried.error());
  }
  const auto made = services.reload(name, request.value("fresh", false));
  if (!made) return std::unexpected(made.error());
  auto answer = tell(services, made->asked);
  if (!answer) return answer;
  answer->update({{"name", name}, {"changed", made->changed}});
  if (!made->asked.done) return answer;
  (*answer)["carried"] = made->kept == runtime::Kept::kState;
  (*answer)["afresh"] = why_afresh(made->kept);
  (*answer)["left"] = made->left;
  return answer;
}

Result<Json> show(RunServices& services, const hal::RobotConfig& robot, const Json& request) {
  const std::string name = request.value("name", std::string());
  if (request.contains("name")) {
    if (const auto known = services.parameters(name); !known) return std::unexpected(known.error());
  }
  Json shown = Json::array();
  for (Json& one : list(services, robot, name)) {
    const auto parameters = services.parameters(one["name"].get<std::string>());
    if (!parameters) continue;  // unloaded just now
    one["parameters"] = parameters_json(*parameters);
    shown.push_back(std::move(one));
  }
  return Json{{"controllers", std::move(shown)}};
}

/// Controller and parameter of "tuned.kp.elbow": names of both may have dots.
Result<runtime::ParameterWish> split(RunServices& services, const std::string& name) {
  std::size_t longest = 0;
  for (const runtime::ControllerStatus& one : services.controllers()) {
    if (name.starts_with(one.name + ".")) longest = std::max(longest, one.name.size());
  }
  const std::size_t dot = longest > 0 ? longest : name.rfind('.');
  if (dot != std::string::npos)
    return runtime::ParameterWish{name.substr(0, dot), name.substr(dot + 1), {}};
  return fail_at(std::string(whole_characters(name, kMostNamed)), "names no controller",
                 "write NAME.PARAMETER, or give the controller's \"name\"");
}

/// @param name  of the controller; empty: `parameter` begins with it
Result<runtime::ParameterWish> wish_of(RunServices& services, const std::string& name,
                                       const std::string& parameter, const Json& value) {
  runtime::ParameterWish wish{.controller = name, .parameter = parameter, .value = {}};
  if (name.empty()) {
    auto both = split(services, parameter);
    if (!both) return both;
    wish = std::move(*both);
  }
  if (value.is_boolean()) {
    wish.value = value.get<bool>();
  } else if (value.is_number()) {
    wish.value = value.get<double>();
  } else if (value.is_string()) {
    wish.value = value.get<std::string>();
  } else if (value.is_array()) {
    const bool numbers =
        std::ranges::all_of(value, [](const Json& one) { return one.is_number(); });
    if (!numbers) {
      return fail_at(std::string(whole_characters(parameter, kMostNamed)),
                     "is a list with other things than numbers", "give numbers: [40, 40, 20]");
    }
    wish.value = value.get<std::vector<double>>();
  }
  return wish;
}

/// What became of it, and the values that are in force after it.
Result<Json> set_these(RunServices& services, const std::vector<runtime::ParameterWish>& wishes) {
  const auto asked = services.set_parameters(wishes);
  if (!asked) return std::unexpected(asked.error());
  Json answer = asked_json(*asked);
  Json& values = answer["values"] = Json::object();
  for (const runtime::ParameterWish& wish : wishes) {
    const auto now = services.parameters(wish.controller);
    if (!now) continue;
    Json& value = values[wish.controller + "." + wish.parameter];
    for (const runtime::ParameterStatus& one : *now) {
      if (one.name == wish.parameter) value = value_json(one, one.value);
      if (one.list == wish.parameter) value.push_back(value_json(one, one.value));
    }
  }
  return answer;
}

Result<Json> set(RunServices& services, const Json& request) {
  const std::string name = request.value("name", std::string());
  const bool each = request.value("each", false);
  std::vector<runtime::ParameterWish> wishes;
  Json results = Json::object();
  if (const std::size_t count = request["parameters"].size();
      count > runtime::kMostParameterChanges) {
    return fail(fmt::format("sets {} parameters at once", count),
                fmt::format("set at most {}", runtime::kMostParameterChanges));
  }
  for (const auto& [parameter, value] : request["parameters"].items()) {
    auto wish = wish_of(services, name, parameter, value);
    if (!each) {
      if (!wish) return std::unexpected(wish.error());
      wishes.push_back(std::move(*wish));
      continue;
    }
    const Result<Json> asked =
        wish ? set_these(services, {*wish}) : Result<Json>(std::unexpected(wish.error()));
    results[parameter] = asked ? "" : asked.error().to_string();
  }
  if (each) return Json{{"results", std::move(results)}};
  return set_these(services, wishes);
}

Names names_of(const Json& request, const char* key) {
  return request.contains(key) ? request[key].get<Names>() : Names{};
}

}  // namespace

Status check_no_owner(RunServices& services, const std::vector<std::string>& names) {
  for (const runtime::ControllerStatus& one : services.controllers()) {
    if (one.name != runtime::kOwnerController || !one.plugin.empty()) continue;
    if (std::ranges::find(names, one.name) == names.end()) continue;
    return fail("'" + one.name + "' is the owner in another process: it comes and goes by itself",
                "end the owner's run; `tandem estop` stops the robot in any case");
  }
  return {};
}

Json asked_json(const runtime::RequestResult& asked) {
  if (asked.done) return {{"done", true}, {"cycle", asked.cycle}};
  if (asked.stands) {
    return {{"done", false},
            {"note",
             "asked for; it will happen in the loop's next cycle, or be refused by it, as "
             "time stands: then the run's output and its log tell (tandem clock step)"}};
  }
  return {{"done", false}, {"note", "asked for; it will happen in the loop's next cycle"}};
}

void add_controller_commands(ControlRegistry& registry, RunServices& services,
                             const hal::RobotConfig& robot, TryController trial) {
  registry.add("controller.list", [&services, &robot](const Json&) -> Result<Json> {
    return Json{{"controllers", list(services, robot)}};
  });
  registry.add("controller.available", [](const Json&) -> Result<Json> {
    return Json{{"plugins", available_controllers(controller_folders())}};
  });
  registry.add("controller.show",
               [&services, &robot](const Json& request) { return show(services, robot, request); });
  registry.add("controller.set",
               [&services](const Json& request) { return set(services, request); });
  registry.add("controller.load",
               [&services, trial](const Json& request) { return load(services, trial, request); });
  registry.add("controller.reload", [&services, trial = std::move(trial)](const Json& request) {
    return reload(services, trial, request);
  });
  registry.add("controller.unload", [&services](const Json& request) {
    return tell(services, services.unload(request["name"].get<std::string>()));
  });
  registry.add("controller.start", [&services, &robot](const Json& request) {
    if (!request.contains("name")) return tell(services, services.go_on());
    const Names names{request["name"].get<std::string>()};
    return switch_by_hand(services, robot, {}, names, request);
  });
  registry.add("controller.stop", [&services, &robot](const Json& request) {
    const Names names{request["name"].get<std::string>()};
    return switch_by_hand(services, robot, names, {}, request);
  });
  registry.add("controller.switch", [&services, &robot](const Json& request) {
    return switch_by_hand(services, robot, names_of(request, "stop"), names_of(request, "start"),
                          request);
  });
  add_shadow_commands(registry, services, robot);
}

}  // namespace tandem::apps
