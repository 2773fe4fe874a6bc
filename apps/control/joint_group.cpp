#include "apps/control/joint_group.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <string_view>
#include <utility>

#include "apps/control/clock_commands.hpp"
#include "apps/control/controller_control.hpp"
#include "apps/control/joint_tuning.hpp"
#include "base/nearest.hpp"
#include "hal/config/capabilities.hpp"

namespace tandem::apps {
namespace {

using runtime::JointInfo;

constexpr double kCarefulShare = 0.1;  // of a joint's velocity, unless another is asked for
constexpr double kRamp_s = 0.5;        // in which joint.move reaches its speed by default
constexpr double kNear_rad = 1e-9;     // who is so near to the target stays
constexpr double kSlowest = 1e-4;      // of a joint's velocity: of who is on its way, and near

/// The run, its robot, and how far and fast each joint goes.
struct Groups {
  runtime::RobotCycle& cycle;
  const hal::RobotConfig& robot;
  std::vector<hal::JointCapabilities> limits;
  LeadSite lead = {};
};

double seconds_of(double way, const hal::JointCapabilities& limit, double share = 1.0) {
  return way / (share * limit.max_velocity_rad_s);
}

double reference_of(const JointInfo& joint) {
  return std::isfinite(joint.look.commanded_rad) ? joint.look.commanded_rad
                                                 : joint.look.position_rad;
}

/// Whether a joint can be led from here: said before any of the group begins to move.
Status check_free(const JointInfo& joint) {
  if (!joint.owner.empty()) {
    return fail_at(joint.name, fmt::format("the controller '{}' has this joint", joint.owner),
                   "stop it first: tandem controller stop " + joint.owner);
  }
  if (joint.look.mode == static_cast<std::int8_t>(hal::ControlMode::kPosition)) return {};
  return fail_at(
      joint.name,
      fmt::format("is in the mode {}, which has no path",
                  hal::to_string(static_cast<hal::ControlMode>(joint.look.mode))),
      fmt::format("put it into position control: tandem joint set {} --mode position", joint.name));
}

/// The path of one joint of a group. A joint that is on its way elsewhere is turned round in the
/// same time, however slow it is to be.
runtime::MoveRequest path_of(const JointInfo& joint, const hal::JointCapabilities& limit,
                             double target, double travel_s) {
  const double most = limit.max_velocity_rad_s;
  const double speed =
      std::clamp(std::abs(target - reference_of(joint)) / travel_s, kSlowest * most, most);
  const double ramp = (speed + std::abs(joint.look.velocity_rad_s)) / kRamp_s;
  return {.target_rad = target,
          .speed_rad_s = speed,
          .acceleration_rad_s2 = std::min(ramp, limit.max_acceleration_rad_s2)};
}

/// Each joint goes by the path of joint.move, slower than it may where others have a longer way, so
/// that they arrive together. All begin, or none goes on.
/// @param travel_s  of the whole way at full speed, without the ramps
Result<Json> begin(const Groups& run, const std::vector<JointInfo>& all, const LedJoints& group,
                   double travel_s) {
  if (run.cycle.services().asks_ahead()) return Json::object();
  if (time_stands(run.cycle)) {
    return fail("simulated time stands: a group would not begin together",
                "let it go on first: tandem clock resume");
  }
  for (const std::size_t j : group.joints) {
    if (Status free = check_free(all[j]); !free) return std::unexpected(free.error());
  }
  runtime::RunServices& services = run.cycle.services();
  Json names = Json::array();
  Json answer{{"done", true}};
  for (std::size_t i = 0; i < group.joints.size(); ++i) {
    const std::size_t j = group.joints[i];
    const double target = group.target_rad[i];
    if (std::abs(target - reference_of(all[j])) < kNear_rad && all[j].look.moving == 0) continue;
    const auto asked =
        services.move_joint(all[j].name, path_of(all[j], run.limits[j], target, travel_s));
    if (!asked) {
      for (const Json& begun : names) (void)services.move_joint(begun.get<std::string>(), {});
      return std::unexpected(asked.error());
    }
    answer.update(asked_json(*asked));
    names.push_back(all[j].name);
  }
  if (names.empty()) answer["note"] = "nothing moves: every joint is where it is to be";
  answer["duration_s"] = names.empty() ? 0.0 : travel_s + kRamp_s;
  answer["joints"] = std::move(names);
  return answer;
}

/// The joints that a request names; all, where it names none.
Result<std::vector<std::size_t>> joints_of(const hal::RobotConfig& robot, const Json& request) {
  std::vector<std::size_t> joints;
  if (!request.contains("joints")) {
    for (std::size_t j = 0; j < robot.joints.size(); ++j) joints.push_back(j);
    return joints;
  }
  for (const Json& name : request["joints"]) {
    const auto text = name.get<std::string>();
    const int index = robot.joint_index(text);
    if (index < 0) return std::unexpected(robot.no_joint(text));
    const auto j = static_cast<std::size_t>(index);
    if (std::ranges::find(joints, j) == joints.end()) joints.push_back(j);
  }
  if (joints.empty()) return fail("joint.posture: no joint is named", "leave out joints: all move");
  return joints;
}

Result<const hal::PostureConfig*> posture_of(const hal::RobotConfig& robot,
                                             const std::string& name) {
  if (const hal::PostureConfig* found = robot.posture(name)) return found;
  std::vector<std::string> known;
  for (const hal::PostureConfig& one : robot.postures) known.push_back(one.name);
  return fail_at(name, "the robot has no posture of that name",
                 known.empty() ? "give it a [posture.NAME] in robot.toml" : suggest(name, known));
}

Result<Json> posture(const Groups& run, const Json& request) {
  const auto wanted = posture_of(run.robot, request["posture"].get<std::string>());
  if (!wanted) return std::unexpected(wanted.error());
  auto joints = joints_of(run.robot, request);
  if (!joints) return std::unexpected(joints.error());
  const double share = request.value("speed", kCarefulShare);
  const std::vector<JointInfo> all = run.cycle.services().joints();
  LedJoints group{.joints = std::move(*joints), .target_rad = {}};
  double travel_s = kRamp_s;
  for (const std::size_t j : group.joints) {
    const double target = (*wanted)->position_rad[j];
    group.target_rad.push_back(target);
    travel_s = std::max(travel_s,
                        seconds_of(std::abs(target - reference_of(all[j])), run.limits[j], share));
  }
  Result<Json> answer = begin(run, all, group, travel_s);
  if (answer) (*answer)["posture"] = request["posture"];
  return answer;
}

constexpr std::array<std::string_view, 6> kAxes{"x", "y", "z", "roll", "pitch", "yaw"};
constexpr std::array kCarefulSpeed{0.05, 0.2};  // of a site [m/s], [rad/s]

/// A step of a site, by a straight line of its joints, none of which is faster than it may be.
Result<Json> move_site(const Groups& run, const Json& request) {
  const auto site = request["site"].get<std::string>();
  if (run.cycle.services().asks_ahead()) {  // where it is then, nobody knows
    std::vector<std::string> known;
    for (const hal::SiteConfig& one : run.robot.model.sites) known.push_back(one.name);
    if (std::ranges::find(known, site) == known.end())
      return fail_at(site, "the robot has no site of that name", suggest(site, known));
    return Json::object();
  }
  const auto name = request["axis"].get<std::string>();
  const auto axis = static_cast<std::size_t>(std::ranges::find(kAxes, name) - kAxes.begin());
  const double by = request["by"];
  const double speed = request.value("speed", kCarefulSpeed[axis < 3 ? 0 : 1]);
  const std::vector<JointInfo> all = run.cycle.services().joints();
  std::vector<double> from;
  for (const JointInfo& joint : all) from.push_back(reference_of(joint));
  const bool own = request.value("axes", std::string("base")) == "site";
  const auto led = run.lead(site, axis, own, by, from);
  if (!led) return std::unexpected(led.error());
  double travel_s = std::abs(by) / speed;
  for (std::size_t i = 0; i < led->joints.size(); ++i) {
    const std::size_t j = led->joints[i];
    travel_s =
        std::max(travel_s, seconds_of(std::abs(led->target_rad[i] - from[j]), run.limits[j]));
  }
  Result<Json> answer = begin(run, all, *led, travel_s);
  if (answer) (*answer)["site"] = request["site"];
  return answer;
}

}  // namespace

void add_group_commands(ControlRegistry& registry, runtime::RobotCycle& cycle,
                        const hal::RobotConfig& robot, LeadSite lead) {
  const auto run = std::make_shared<const Groups>(
      Groups{cycle, robot, hal::joint_capabilities(robot), std::move(lead)});
  registry.add("joint.tuning", [run](const Json&) -> Result<Json> {
    Tuning tuning = tuning_of(run->robot, run->cycle.services().joints());
    return Json{{"toml", std::move(tuning.toml)}, {"changed", std::move(tuning.changed)}};
  });
  registry.add("joint.posture", [run](const Json& request) { return posture(*run, request); });
  if (!run->lead) return;
  registry.add("site.move", [run](const Json& request) { return move_site(*run, request); });
}

}  // namespace tandem::apps
