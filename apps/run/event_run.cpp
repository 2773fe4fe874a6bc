#include "apps/run/event_run.hpp"

#include <string>

#include "apps/control/run_control.hpp"
#include "apps/run/inject.hpp"
#include "apps/run/lead_site.hpp"
#include "apps/text/json_reader.hpp"
#include "hal/sim/scenario.hpp"
#include "runtime/run/run.hpp"

namespace tandem::apps {
namespace {

Status check_request(const Json& request, const runtime::Experiment& e) {
  if (Status keys = check_event(request); !keys) return keys;
  if (const auto joint = request.find("joint"); joint != request.end() && joint->is_string()) {
    const auto name = joint->get<std::string>();
    if (e.robot.joint_index(name) < 0) {
      const Error none = e.robot.no_joint(name);
      return fail(none.message, none.hint);
    }
  }
  if (request["do"] != "inject" && request["do"] != "push") return {};
  const auto faults = sim::parse_scenario(scenario_of(request), "its scenario", e.robot,
                                          e.loop.period_ns, e.tree().get());
  if (faults) return {};
  return fail(faults.error().front().to_string());
}

Error of_event(const Error& what, const runtime::EventSpec& event, const runtime::Experiment& e) {
  Error error = what;
  error.file = e.file;
  error.line = event.ask_line;
  error.key = event.name + ".ask";
  return error;
}

}  // namespace

Diagnostics check_events(const runtime::Experiment& e) {
  Diagnostics errors;
  for (const runtime::EventSpec& event : e.events) {
    if (event.fault) continue;
    const Result<Json> request = read_json_object(event.ask);
    const Status right =
        request ? check_request(*request, e) : Status(std::unexpected(request.error()));
    if (!right) errors.push_back(of_event(right.error(), event, e));
  }
  return errors;
}

Diagnostics ask_ahead(WiredComposition& c, const TryController& trial) {
  const runtime::Experiment& e = c.experiment;
  if (c.events == nullptr || !c.events->asks() || c.controllers == nullptr || c.backend == nullptr)
    return {};
  runtime::Run run(c, {}, {});
  run.cycle().services().ask_ahead();
  ControlRegistry commands;
  add_run_commands(commands, run.cycle(), e.robot, {}, trial,
                   {.lead = lead_site(e.robot, c.kernels.get())});
  const auto add = [&c](const sim::ScenarioFault& fault) {
    const bool can = c.sim == nullptr || c.sim->robot().can_begin(fault);
    return injected(can ? Code::kOk : Code::kOutOfRange);
  };
  add_inject(commands, e.robot, e.tree().get(), e.loop.period_ns, add);
  add_push(commands, e.robot, e.tree().get(), e.loop.period_ns, add);
  Diagnostics errors;
  for (const bool first : {true, false}) {  // others may name what is loaded
    for (const runtime::EventSpec& event : e.events) {
      if (event.fault) continue;
      const Result<Json> request = read_json_object(event.ask);
      if (!request || (request->value("do", "") == "controller.load") != first) continue;
      const Json answer = commands.answer(event.ask);
      if (answer.value("ok", false)) continue;
      const Error refused{.message = answer.value("error", "no answer"),
                          .hint = answer.value("hint", ""),
                          .file = {},
                          .key = {}};
      errors.push_back(of_event(refused, event, e));
    }
  }
  sort_by_line(errors);
  return errors;
}

void carry_out(runtime::Events& events, const ControlRegistry& registry,
               runtime::RobotCycle& cycle) {
  events.ask_by([&registry, &cycle](const std::string& request) -> Status {
    const Json answer = registry.answer(
        request, {.after_stop = registry.last_stop(), .meanwhile = [&cycle] { cycle.attend(); }});
    if (answer.value("ok", false)) return {};
    return fail(answer.value("error", "no answer"), answer.value("hint", ""));
  });
}

}  // namespace tandem::apps
