#include "apps/control/shadow_control.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "apps/control/controller_control.hpp"
#include "hal/text_event.hpp"

namespace tandem::apps {
namespace {

using runtime::RunServices;

constexpr double kTimeout_s = 10.0;

Json number_or_null(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }

const char* unit_of(const hal::RobotConfig& robot, std::size_t joint,
                    runtime::CommandReference reference) {
  const auto& row = runtime::kCommandReferenceRows[static_cast<std::size_t>(reference)];
  return robot.joints[joint].slides ? row.slide_unit : row.unit;
}

/// Whether what has to agree is an angle, or a length, in each joint that one to start claims.
Status check_within_unit(RunServices& services, const hal::RobotConfig& robot,
                         const std::vector<std::string>& start, const std::string& unit) {
  const std::string_view given = unit == "length" ? "m" : "rad";
  for (const runtime::ControllerStatus& one : services.controllers()) {
    if (std::ranges::find(start, one.name) == start.end()) continue;
    for (const auto& claim : one.claims) {
      const auto used = runtime::references_of(static_cast<std::int8_t>(claim.mode));
      if (used.empty() || unit_of(robot, claim.joint, used.front()) == given) continue;
      const std::string is = unit_of(robot, claim.joint, used.front());
      return fail_at(robot.joints[claim.joint].name,
                     fmt::format("when_within is {}, and the reference of this joint, which '{}' "
                                 "claims, is in {}",
                                 unit == "length" ? "a length" : "an angle", one.name, is),
                     is == "rad" ? "give an angle: 0.5deg, 0.01rad; or a bare number [rad]"
                     : is == "m" ? "give a length: 1mm, 0.001m; or a bare number [m]"
                                 : "give a bare number [" + is + "]");
    }
  }
  return {};
}

Json joint_json(const hal::RobotConfig& robot, std::size_t joint, const std::string& owner,
                const runtime::JointDifference& one) {
  const auto mode = [](std::int8_t of) {
    return hal::to_string(static_cast<hal::ControlMode>(of));
  };
  const auto interaction = [](std::uint8_t of) {
    return hal::to_string(static_cast<hal::InteractionMode>(of));
  };
  Json references = Json::array();
  for (const runtime::CommandReference reference : runtime::references_of(one.mode)) {
    const auto r = static_cast<std::size_t>(reference);
    references.push_back({{"name", runtime::kCommandReferenceRows[r].name},
                          {"unit", unit_of(robot, joint, reference)},
                          {"difference", number_or_null(one.now[r])},
                          {"largest", number_or_null(one.most[r])},
                          {"largest_step", number_or_null(one.step[r])}});
  }
  return {{"joint", robot.joints[joint].name},
          {"owner", owner},
          {"mode", mode(one.mode)},
          {"interaction", interaction(one.interaction)},
          {"commanded_mode", mode(one.commanded_mode)},
          {"commanded_interaction", interaction(one.commanded_interaction)},
          {"references", std::move(references)}};
}

/// Why it is no shadow any more; null: it is one.
Json end_json(const runtime::ShadowStatus& shadow, const hal::RobotConfig& robot) {
  if (shadow.runs) return nullptr;
  const std::int32_t joint = shadow.look.joint;
  hal::TextEvent words;
  runtime::append_end(words, shadow.look,
                      joint < 0 ? "" : robot.joints[static_cast<std::size_t>(joint)].name);
  return words.words();
}

Json shadow_json(const runtime::ShadowStatus& shadow, const hal::RobotConfig& robot) {
  Json joints = Json::array();
  for (std::size_t i = 0; shadow.look.calls > 0 && i < shadow.claims.size(); ++i)
    joints.push_back(joint_json(robot, shadow.claims[i].joint, shadow.owners[i], shadow.joints[i]));
  return {{"name", shadow.name},          {"runs", shadow.runs},
          {"since", shadow.look.since},   {"calls", shadow.look.calls},
          {"missed", shadow.look.missed}, {"ended", end_json(shadow, robot)},
          {"joints", std::move(joints)}};
}

/// The last switch that waited, or waits.
Json switch_json(const runtime::SwitchLook& look, const hal::RobotConfig& robot,
                 const std::vector<runtime::ShadowStatus>& shadows) {
  if (look.state == runtime::SwitchState::kNone) return nullptr;
  Json joint, unit;
  if (look.joint >= 0) {
    const auto index = static_cast<std::size_t>(look.joint);
    joint = robot.joints[index].name;
    for (const runtime::ShadowStatus& shadow : shadows) {
      for (std::size_t i = 0; i < shadow.claims.size(); ++i) {
        const auto used = runtime::references_of(shadow.joints[i].mode);
        if (shadow.claims[i].joint == index && !used.empty())
          unit = unit_of(robot, index, used.front());
      }
    }
  }
  return {{"state", to_string(look.state)},
          {"asked", look.asked},
          {"cycle", look.cycle},
          {"joint", std::move(joint)},
          {"difference", number_or_null(look.difference)},
          {"unit", std::move(unit)}};
}

Result<Json> difference(RunServices& services, const hal::RobotConfig& robot, const Json& request) {
  const std::string name = request.value("name", std::string());
  const auto all = services.shadows();
  const auto found = std::ranges::find(all, name, &runtime::ShadowStatus::name);
  if (!name.empty() && found == all.end()) {
    if (const auto known = services.parameters(name); !known) return std::unexpected(known.error());
    return fail_at(name, "is no shadow", "tandem controller shadow " + name);
  }
  Json shadows = Json::array();
  for (const runtime::ShadowStatus& one : all) {
    if (name.empty() || one.name == name) shadows.push_back(shadow_json(one, robot));
  }
  return Json{{"shadows", std::move(shadows)},
              {"switch", switch_json(services.last_switch(), robot, all)}};
}

Result<Json> shadow(RunServices& services, const Json& request) {
  const auto name = request["name"].get<std::string>();
  if (const Status own = check_no_owner(services, {name}); !own)
    return std::unexpected(own.error());
  const auto asked =
      request.value("end", false) ? services.end_shadow(name) : services.begin_shadow(name);
  if (!asked) return std::unexpected(asked.error());
  Json answer = asked_json(*asked);
  answer["name"] = name;
  return answer;
}

}  // namespace

void add_shadow_commands(ControlRegistry& registry, RunServices& services,
                         const hal::RobotConfig& robot) {
  registry.add("controller.shadow",
               [&services](const Json& request) { return shadow(services, request); });
  registry.add("controller.difference", [&services, &robot](const Json& request) {
    return difference(services, robot, request);
  });
}

Result<runtime::RequestResult> switch_when(RunServices& services, const hal::RobotConfig& robot,
                                           const std::vector<std::string>& stop,
                                           const std::vector<std::string>& start,
                                           const Json& request) {
  if (request.contains("unit")) {
    const Status fits =
        check_within_unit(services, robot, start, request["unit"].get<std::string>());
    if (!fits) return std::unexpected(fits.error());
  }
  return services.switch_when(
      stop, start, request["when_within"].get<double>(),
      static_cast<std::int64_t>(1e9 * request.value("timeout_s", kTimeout_s)));
}

}  // namespace tandem::apps
