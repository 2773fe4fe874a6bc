#include "apps/control/input_control.hpp"

#include <algorithm>
#include <span>
#include <string>
#include <vector>

#include "apps/control/controller_control.hpp"
#include "base/quoting.hpp"

namespace tandem::apps {
namespace {

using runtime::InputReport;
using runtime::InputRequest;

/// The way-points of a trajectory.
Json points_of(const InputBlock& input, std::span<const double> value) {
  const std::size_t joints = input.components.size();
  Json points = Json::array();
  for (std::size_t p = 0; p < static_cast<std::size_t>(value[0]); ++p) {
    const auto point = value.subspan(2 + p * (1 + 2 * joints), 1 + 2 * joints);
    Json one{{"after_s", point[0]}, {"position_rad", point.subspan(1, joints)}};
    if (value[1] != 0.0) one["velocity_rad_s"] = point.subspan(1 + joints);
    points.push_back(std::move(one));
  }
  return points;
}

/// What holds, by the components' names.
Json values_of(const InputBlock& input, std::span<const double> value) {
  Json values = Json::object();
  for (std::size_t i = 0; i < input.components.size(); ++i) values[input.components[i]] = value[i];
  return values;
}

const char* to_string(AfterTimeout after) {
  switch (after) {
    case AfterTimeout::kDefault: return "default";
    case AfterTimeout::kZero: return "zero";
    case AfterTimeout::kLast: return "last";
  }
  return "?";
}

Json input_json(const InputReport& report) {
  const runtime::InputPort& port = *report.port;
  const InputBlock& input = port.input();
  const runtime::InputCounts& counts = report.look.counts;
  Json json{{"input", input.name},
            {"controller", port.controller()},
            {"kind", row_of(input.kind).name},
            {"doc", input.options.doc},
            {"source", runtime::to_string(port.source().feeder)},
            {"active", report.active},
            {"fresh", report.look.fresh},
            {"sequence", report.look.sequence},
            {"cycle", report.look.cycle},
            {"timeout_s", input.options.timeout_s},
            {"after", to_string(input.options.after)},
            {"components", input.components},
            {"units", input.units},
            {"arrived", counts.arrived},
            {"refused", counts.refused},
            {"why", report.look.why},
            {"superseded", counts.superseded},
            {"timed_out", counts.timed_out}};
  if (input.kind == InputKind::kTrajectory) {
    json["points"] = points_of(input, report.look.value);
  } else {
    json["values"] = values_of(input, report.look.value);
  }
  return json;
}

Json list(runtime::RunServices& services) {
  Json all = Json::array();
  for (const InputReport& report : services.inputs()) all.push_back(input_json(report));
  return {{"inputs", std::move(all)}};
}

/// A list of numbers. Error: something else.
Result<std::vector<double>> numbers_of(const Json& object, const char* key, bool needed) {
  const auto found = object.find(key);
  if (found == object.end() && !needed) return std::vector<double>();
  std::vector<double> numbers;
  const bool list = found != object.end() && found->is_array();
  for (const Json& one : list ? *found : Json::array()) {
    if (one.is_string()) {
      return fail_at(key, "'" + shown(one.get<std::string>()) + "' is no finite number",
                     "a number per joint");
    }
    if (!one.is_number()) return fail_at(key, "is no list of numbers", "a number per joint");
    numbers.push_back(one.get<double>());
  }
  if (!list) return fail_at(key, "is no list of numbers", "a number per joint");
  return numbers;
}

Status add_points(const Json& trajectory, InputRequest& wish) {
  const auto points = trajectory.find("points");
  if (points == trajectory.end() || !points->is_array() || trajectory.size() != 1) {
    return fail_at("trajectory", "is not {\"points\": [ … ]}", "no points: the joints stay");
  }
  for (const Json& point : *points) {
    if (!point.is_object() || !point.contains("after_s") || !point["after_s"].is_number()) {
      return fail_at("points", "a way-point has no number after_s", "seconds after the sample");
    }
    for (const auto& [key, value] : point.items()) {
      if (key == "after_s" || key == "position_rad" || key == "velocity_rad_s") continue;
      return fail_at("points", "a way-point has no key '" + key + "'",
                     "after_s, position_rad, velocity_rad_s");
    }
    auto position = numbers_of(point, "position_rad", true);
    if (!position) return std::unexpected(position.error());
    auto velocity = numbers_of(point, "velocity_rad_s", false);
    if (!velocity) return std::unexpected(velocity.error());
    wish.points.push_back(
        {point["after_s"].get<double>(), std::move(*position), std::move(*velocity)});
  }
  return {};
}

/// "x is in m/s: write x=0.2"
std::string number_hint(runtime::RunServices& services, const std::string& name,
                        const std::string& component) {
  for (const InputReport& report : services.inputs()) {
    const InputBlock& input = report.port->input();
    const auto found = std::ranges::find(input.components, component);
    if (found == input.components.end()) continue;
    if (name != input.name && name != report.port->full_name()) continue;
    const auto index = static_cast<std::size_t>(found - input.components.begin());
    const std::string unit = index < input.units.size() ? input.units[index] : "";
    return (unit.empty() ? "" : component + " is in " + unit + ": ") + "write " + component +
           "=0.2";
  }
  return "values: numbers by name";
}

Result<InputRequest> wish_of(runtime::RunServices& services, const Json& request) {
  InputRequest wish;
  if (request.contains("trajectory")) {
    const Status added = add_points(request["trajectory"], wish);
    if (!added) return std::unexpected(added.error());
  }
  const Json none = Json::object();
  const Json& values = request.contains("values") ? request["values"] : none;
  for (const auto& [component, value] : values.items()) {
    if (!value.is_number()) {
      const std::string text = value.is_string() ? value.get<std::string>() : json_text(value);
      return fail_at(component, "'" + shown(text) + "' is no finite number",
                     number_hint(services, request["name"].get<std::string>(), component));
    }
    wish.components.push_back(component);
    wish.numbers.push_back(value.get<double>());
  }
  return wish;
}

Result<Json> set_input(runtime::RunServices& services, const Json& request) {
  if (request.contains("values") == request.contains("trajectory")) {
    return fail("input.set: give the values, or a trajectory", "tandem input list shows which");
  }
  const std::string name = request["name"].get<std::string>();
  const auto wish = wish_of(services, request);
  if (!wish) {
    services.refuse_input(name, wish.error());
    return std::unexpected(wish.error());
  }
  const auto asked = services.set_input(name, *wish);
  if (!asked) return std::unexpected(asked.error());
  return asked_json(*asked);
}

}  // namespace

void add_input_commands(ControlRegistry& registry, runtime::RunServices& services) {
  registry.add("input.list", [&services](const Json&) -> Result<Json> { return list(services); });
  registry.add("input.set",
               [&services](const Json& request) { return set_input(services, request); });
}

}  // namespace tandem::apps
