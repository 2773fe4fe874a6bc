#include "apps/control/joint_control.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>

#include "apps/control/controller_control.hpp"
#include "base/nearest.hpp"

namespace tandem::apps {
namespace {

using hal::ControlMode;
using hal::InteractionMode;
using runtime::RobotCycle;

constexpr std::array kModes{ControlMode::kIdle,   ControlMode::kPosition, ControlMode::kVelocity,
                            ControlMode::kTorque, ControlMode::kOpenLoop, ControlMode::kCurrent};
constexpr std::array kInteractions{InteractionMode::kStiff, InteractionMode::kCompliant};
constexpr std::array kLoops{hal::PidLoop::kPosition, hal::PidLoop::kVelocity, hal::PidLoop::kTorque,
                            hal::PidLoop::kCurrent};

/// The value of `known` that `request[key]` names.
template <class Enum, std::size_t N>
Result<Enum> choice(const Json& request, const char* key, const std::array<Enum, N>& known) {
  const auto wanted = request[key].get<std::string>();
  std::vector<std::string> names;
  for (const Enum value : known) {
    names.emplace_back(hal::to_string(value));
    if (names.back() == wanted) return value;
  }
  return fail(fmt::format("\"{}\": there is no '{}'", key, wanted), suggest(wanted, names));
}

/// @param index  of the joint in the image
Json joint_json(const RobotCycle& run, const runtime::JointInfo& joint, std::size_t index) {
  const runtime::JointStatus& look = joint.look;
  Json gains = Json::object();
  for (const hal::PidLoop loop : kLoops) {
    const hal::PidGains& of = joint.gains[static_cast<std::size_t>(loop)];
    gains[hal::to_string(loop)] = {{"kp", of.kp}, {"ki", of.ki}, {"kd", of.kd}};
  }
  return {{"joint", joint.name},
          {"slides", joint.slides},
          {"controller", joint.owner},
          {"mode", hal::to_string(static_cast<ControlMode>(look.mode))},
          {"interaction", hal::to_string(static_cast<InteractionMode>(look.interaction))},
          {"mode_in_force", hal::to_string(static_cast<ControlMode>(look.drive_mode))},
          {"commanded_position_rad", look.commanded_rad},
          {"moving", look.moving != 0},
          {"position_rad", look.position_rad},
          {"velocity_rad_s", look.velocity_rad_s},
          {"torque_Nm", look.torque_Nm},
          {"acceleration_rad_s2", look.acceleration_rad_s2},
          {"motor_position_rad", look.motor_position_rad},
          {"motor_velocity_rad_s", look.motor_velocity_rad_s},
          {"current_A", look.current_A},
          {"voltage_V", look.voltage_V},
          {"temperature_C", look.temperature_C},
          {"stiffness_Nm_rad", look.stiffness_Nm_rad},
          {"damping_Nms_rad", look.damping_Nms_rad},
          {"drive_state", hal::to_string(static_cast<hal::DriveState>(look.drive_state))},
          {"fault", look.fault},
          {"fault_text", run.drive_fault(index, look.fault)},
          {"resetting", look.resetting != 0},
          {"age_cycles", look.age_cycles},
          {"gains", std::move(gains)}};
}

Json list(RobotCycle& run) {
  Json all = Json::array();
  std::uint64_t cycle = 0;
  for (const runtime::JointInfo& joint : run.services().joints()) {
    cycle = joint.look.cycle;
    all.push_back(joint_json(run, joint, all.size()));
  }
  return {{"cycle", cycle}, {"joints", std::move(all)}};
}

/// What was done, and what the joint is now. A controller's own joints are its own.
Result<Json> tell(RobotCycle& run, const std::string& name,
                  const Result<runtime::RequestResult>& asked) {
  if (!asked) return std::unexpected(asked.error());
  Json answer = asked_json(*asked);
  std::size_t index = 0;
  for (const runtime::JointInfo& joint : run.services().joints()) {
    const std::size_t j = index++;
    if (joint.name != name) continue;
    answer.update(joint_json(run, joint, j));
    if (!joint.owner.empty() && asked->done) {
      answer["note"] = fmt::format(
          "the controller '{}' has the joint: what it writes each cycle goes first", joint.owner);
    }
  }
  return answer;
}

Result<Json> set(RobotCycle& run, const Json& request) {
  const auto joint = request["joint"].get<std::string>();
  if (request.size() == 2) return fail("joint.set: nothing is to be set", "name a value");
  runtime::JointRequest wish;
  if (request.contains("mode")) {
    const auto mode = choice(request, "mode", kModes);
    if (!mode) return std::unexpected(mode.error());
    wish.mode = static_cast<std::int32_t>(*mode);
  }
  if (request.contains("interaction")) {
    const auto interaction = choice(request, "interaction", kInteractions);
    if (!interaction) return std::unexpected(interaction.error());
    wish.interaction = static_cast<std::int32_t>(*interaction);
  }
  wish.stiffness_Nm_rad = request.value("stiffness_Nm_rad", wish.stiffness_Nm_rad);
  wish.damping_Nms_rad = request.value("damping_Nms_rad", wish.damping_Nms_rad);
  return tell(run, joint, run.services().set_joint(joint, wish));
}

/// Whether values in `unit` fit the joint; one that does not exist is refused elsewhere.
Status check_unit(RobotCycle& run, const std::string& name, const std::string& unit) {
  for (const runtime::JointInfo& joint : run.services().joints()) {
    if (joint.name != name || unit == (joint.slides ? "length" : "angle")) continue;
    return fail_at(name, fmt::format("this joint {}", joint.slides ? "slides" : "turns"),
                   joint.slides ? "give metres: 20mm, 0.02m" : "give an angle: 30deg, 0.5rad");
  }
  return {};
}

Result<Json> move(RobotCycle& run, const Json& request) {
  const auto joint = request["joint"].get<std::string>();
  if (request.contains("unit")) {
    const Status fits = check_unit(run, joint, request["unit"].get<std::string>());
    if (!fits) return std::unexpected(fits.error());
  }
  runtime::MoveRequest wish{.target_rad = request["target_rad"].get<double>()};
  wish.speed_rad_s = request.value("speed_rad_s", wish.speed_rad_s);
  wish.acceleration_rad_s2 = request.value("acceleration_rad_s2", wish.acceleration_rad_s2);
  return tell(run, joint, run.services().move_joint(joint, wish));
}

Result<Json> reset(RobotCycle& run, const std::string& name) {
  const auto joints = run.services().joints();
  const auto joint = std::ranges::find(joints, name, &runtime::JointInfo::name);
  const bool latched = joint != joints.end() && joint->look.fault != 0;
  Result<Json> answer = tell(run, name, run.services().reset_joint(name));
  if (!answer) return answer;
  (*answer)["latched"] = latched;
  if (answer->value("done", false)) answer->erase("note");  // its drive is nobody's
  return answer;
}

Result<Json> set_gains(RobotCycle& run, const Json& request) {
  const auto joint = request["joint"].get<std::string>();
  const auto loop = choice(request, "loop", kLoops);
  if (!loop) return std::unexpected(loop.error());
  runtime::GainsRequest wish;
  if (request.contains("kp")) wish.kp = request["kp"].get<double>();
  if (request.contains("ki")) wish.ki = request["ki"].get<double>();
  if (request.contains("kd")) wish.kd = request["kd"].get<double>();
  if (!wish.kp && !wish.ki && !wish.kd) {
    return fail("joint.gains: nothing is to be set", "give kp, ki or kd");
  }
  auto answer = tell(run, joint, run.services().set_gains(joint, *loop, wish));
  if (answer && answer->value("done", false)) answer->erase("note");  // gains are nobody's
  return answer;
}

}  // namespace

void add_joint_commands(ControlRegistry& registry, RobotCycle& run) {
  using Type = ControlKey::Type;
  const ControlKey joint{.name = "joint", .required = true, .doc = "its name"};
  registry.add("joint.list", ControlEffect::kReads,
               "every joint: who has it, what it does, what is measured", {},
               [&run](const Json&) -> Result<Json> { return list(run); });
  registry.add("joint.set", ControlEffect::kChanges,
               "mode and interaction of a joint that no active controller claims, impedance of any",
               {joint,
                {.name = "mode", .doc = "idle, position, velocity, torque, open_loop, current"},
                {.name = "interaction", .doc = "stiff, compliant"},
                {.name = "stiffness_Nm_rad", .type = Type::kNumber, .doc = "of the virtual spring"},
                {.name = "damping_Nms_rad", .type = Type::kNumber, .doc = "of the virtual damper"}},
               [&run](const Json& request) { return set(run, request); });
  registry.add(
      "joint.move", ControlEffect::kChanges,
      "moves a joint that no active controller claims, with a trapezoidal velocity profile",
      {joint,
       {.name = "target_rad", .type = Type::kNumber, .required = true, .doc = "m of a slide"},
       {.name = "speed_rad_s", .type = Type::kNumber, .doc = "else a quarter of its limit"},
       {.name = "acceleration_rad_s2",
        .type = Type::kNumber,
        .doc = "else it reaches the speed in half a second"},
       {.name = "unit", .doc = "angle, length: what the joint has to be"}},
      [&run](const Json& request) { return move(run, request); });
  registry.add("joint.stop", ControlEffect::kChanges, "brakes a joint that joint.move leads",
               {joint}, [&run](const Json& request) {
                 const auto name = request["joint"].get<std::string>();
                 return tell(run, name, run.services().move_joint(name, {}));
               });
  registry.add("joint.recover", ControlEffect::kChanges,
               "leads a joint that stands outside its limits back, at a twentieth of its velocity",
               {joint}, [&run](const Json& request) {
                 const auto name = request["joint"].get<std::string>();
                 return tell(run, name, run.services().recover(name));
               });
  registry.add(
      "joint.reset", ControlEffect::kChanges,
      "clears the fault of one drive; while the run is faulted nothing is enabled", {joint},
      [&run](const Json& request) { return reset(run, request["joint"].get<std::string>()); });
  registry.add("joint.gains", ControlEffect::kChanges, "gains of a loop in a joint's drive, by SDO",
               {joint,
                {.name = "loop", .required = true, .doc = "position, velocity, torque, current"},
                {.name = "kp", .type = Type::kNumber, .doc = "as in [gains]; it stays if left out"},
                {.name = "ki", .type = Type::kNumber, .doc = "the same"},
                {.name = "kd", .type = Type::kNumber, .doc = "the same"}},
               [&run](const Json& request) { return set_gains(run, request); });
}

}  // namespace tandem::apps
