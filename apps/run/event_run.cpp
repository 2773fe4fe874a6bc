#include "apps/run/event_run.hpp"

#include <string>

#include "apps/run/inject.hpp"
#include "apps/text/json_reader.hpp"
#include "hal/sim/scenario.hpp"

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

}  // namespace

Diagnostics check_events(const runtime::Experiment& e) {
  Diagnostics errors;
  for (const runtime::EventSpec& event : e.events) {
    if (event.fault) continue;
    const Result<Json> request = read_json_object(event.ask);
    const Status right =
        request ? check_request(*request, e) : Status(std::unexpected(request.error()));
    if (right) continue;
    Error error = right.error();
    error.file = e.file;
    error.line = event.ask_line;
    error.key = event.name + ".ask";
    errors.push_back(std::move(error));
  }
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
