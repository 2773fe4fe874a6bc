#include "apps/control/joint_control.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <memory>
#include <numbers>
#include <utility>

#include "apps/control/controller_control.hpp"
#include "hal/config/capabilities.hpp"
#include "hal/motion_limits.hpp"

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
constexpr double kLowMargin_deg = 30.0;

/// The run, its robot, how far each joint goes and what its drive tells.
struct Run {
  RobotCycle& cycle;
  const hal::RobotConfig& robot;
  std::vector<hal::JointCapabilities> limits;
  std::vector<hal::MotorFeedback> motors;
  std::vector<Json> modes;  ///< that each can be put into, by joint
  JudgeGains judge = {};
  /// What joint.gains asked for and the loop has not taken yet, by joint and loop: while a run is
  /// paused. What comes next is judged with it.
  std::map<std::pair<std::size_t, hal::PidLoop>, hal::PidGains> waiting = {};

  /// Null: there is no such joint, which the run itself refuses.
  [[nodiscard]] const hal::JointCapabilities* limits_of(const std::string& joint) const {
    const int index = robot.joint_index(joint);
    return index < 0 ? nullptr : &limits[static_cast<std::size_t>(index)];
  }
};

/// The value of `known` that a request names: one of its key's choices.
template <class Enum, std::size_t N>
Enum choice(const Json& name, const std::array<Enum, N>& known) {
  return *std::ranges::find_if(known, [&](Enum value) { return name == hal::to_string(value); });
}

/// What the figures of a joint are worth. A drive says by the codes 73xx of CiA 402 that one of its
/// sensors gives no value, or contradicts the other: what it goes on to send is no measurement.
const char* feedback_of(const runtime::JointStatus& look) {
  constexpr std::uint32_t kSensors = 0x7300;
  if (look.age_cycles > runtime::CycleConfig().lost_after_cycles) return "lost";
  if ((look.fault & 0xFF00) == kSensors) return "sensor_fault";
  return look.age_cycles > 0 ? "old" : "fresh";
}

/// The modes that each joint can be put into.
std::vector<Json> modes_of(const hal::RobotConfig& robot) {
  std::vector<Json> all;
  for (std::size_t j = 0; j < robot.joints.size(); ++j) {
    Json& modes = all.emplace_back(Json::array());
    for (const ControlMode mode : kModes)
      if (hal::check_capability(robot, j, mode)) modes.push_back(hal::to_string(mode));
  }
  return all;
}

/// @param index  of the joint in the image
Json joint_json(const Run& run, const runtime::JointInfo& joint, std::size_t index) {
  const runtime::JointStatus& look = joint.look;
  const hal::JointCapabilities& limit = run.limits[index];
  const hal::MotorFeedback& tells = run.motors[index];
  const bool heard = look.age_cycles <= look.cycle;  // once, since the run began
  const auto measured = [heard](bool told, double value) {
    return heard && told ? Json(value) : Json(nullptr);
  };
  const auto& homing = run.robot.joints[index].homing;
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
          {"modes", run.modes[index]},
          {"mode_in_force", hal::to_string(static_cast<ControlMode>(look.drive_mode))},
          {"commanded_position_rad",
           std::isfinite(look.commanded_rad) ? Json(look.commanded_rad) : Json(nullptr)},
          {"moving", look.moving != 0},
          {"position_rad", measured(true, look.position_rad)},
          {"velocity_rad_s", measured(true, look.velocity_rad_s)},
          {"torque_Nm", measured(tells.torque, look.torque_Nm)},
          {"min_position_rad", limit.min_position_rad},
          {"max_position_rad", limit.max_position_rad},
          {"max_velocity_rad_s", limit.max_velocity_rad_s},
          {"max_acceleration_rad_s2", limit.max_acceleration_rad_s2},
          {"max_torque_Nm", limit.max_torque_Nm},
          {"acceleration_rad_s2", measured(true, look.acceleration_rad_s2)},
          {"motor_position_rad", measured(tells.position, look.motor_position_rad)},
          {"motor_velocity_rad_s", measured(tells.position, look.motor_velocity_rad_s)},
          {"current_A", measured(tells.current, look.current_A)},
          {"voltage_V", measured(tells.voltage, look.voltage_V)},
          {"temperature_C", measured(tells.temperature, look.temperature_C)},
          {"stiffness_Nm_rad", look.stiffness_Nm_rad},
          {"damping_Nms_rad", look.damping_Nms_rad},
          {"drive_state", hal::to_string(static_cast<hal::DriveState>(look.drive_state))},
          {"fault", look.fault},
          {"fault_text", run.cycle.drive_fault(index, look.fault)},
          {"resetting", look.resetting != 0},
          {"homing", hal::to_string(look.homing.state)},
          {"homing_error", hal::row_of(look.homing.error).words},
          {"homing_method", homing ? Json(homing->method) : Json(nullptr)},
          {"homing_advice", hal::row_of(look.homing.error).advice},
          {"age_cycles", look.age_cycles},
          {"feedback", feedback_of(look)},
          {"gains", std::move(gains)}};
}

Json list(const Run& run) {
  Json all = Json::array();
  std::uint64_t cycle = 0;
  for (const runtime::JointInfo& joint : run.cycle.services().joints()) {
    cycle = joint.look.cycle;
    all.push_back(joint_json(run, joint, all.size()));
  }
  Json followers = Json::object();
  for (const hal::Follower& one : run.robot.followers)
    followers[one.name] = run.robot.joints[one.leader].name;
  return {{"cycle", cycle}, {"joints", std::move(all)}, {"followers", std::move(followers)}};
}

/// What was done, and what the joint is now. A controller's own joints are its own.
Result<Json> tell(const Run& run, const std::string& name,
                  const Result<runtime::RequestResult>& asked) {
  if (!asked) return std::unexpected(asked.error());
  Json answer = asked_json(*asked);
  std::size_t index = 0;
  for (const runtime::JointInfo& joint : run.cycle.services().joints()) {
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

/// A joint that is held keeps its impedance; the one that was asked for comes with a start.
void note_held_impedance(const runtime::JointRequest& wish, Json& answer) {
  if (!answer.value("done", false) || answer.contains("note")) return;
  const auto kept = [&](const char* key, double asked) {
    return !std::isnan(asked) && answer[key] != asked;
  };
  if (!kept("stiffness_Nm_rad", wish.stiffness_Nm_rad) &&
      !kept("damping_Nms_rad", wish.damping_Nms_rad)) {
    return;
  }
  answer["note"] = "the joint is held as it is: its new impedance is in force once controllers run";
}

Result<Json> set(const Run& run, const Json& request) {
  const auto joint = request["joint"].get<std::string>();
  if (request.size() == 2)
    return fail("joint.set: nothing is to be set", "give mode, interaction, stiffness or damping");
  runtime::JointRequest wish;
  if (request.contains("mode")) {
    wish.mode = static_cast<std::int32_t>(choice(request["mode"], kModes));
  }
  if (request.contains("interaction")) {
    wish.interaction = static_cast<std::int32_t>(choice(request["interaction"], kInteractions));
  }
  wish.stiffness_Nm_rad = request.value("stiffness_Nm_rad", wish.stiffness_Nm_rad);
  wish.damping_Nms_rad = request.value("damping_Nms_rad", wish.damping_Nms_rad);
  Result<Json> answer = tell(run, joint, run.cycle.services().set_joint(joint, wish));
  if (answer) note_held_impedance(wish, *answer);
  return answer;
}

/// Whether values in `unit` fit the joint.
Status check_unit(const std::string& name, bool slides, const std::string& unit) {
  if (unit == (slides ? "length" : "angle")) return {};
  return fail_at(name, fmt::format("this joint {}", slides ? "slides" : "turns"),
                 slides ? "give metres: 20mm, 0.02m" : "give an angle: 30deg, 0.5rad");
}

/// The same angle by whole turns, nearest to the joint's reference; as it is where that is beyond
/// the joint's limits.
double shortest(const Run& run, const std::string& name, double target_rad) {
  constexpr double kTurn_rad = 2.0 * std::numbers::pi;
  const auto joints = run.cycle.services().joints();
  const auto joint = std::ranges::find(joints, name, &runtime::JointInfo::name);
  const hal::JointCapabilities* limit = run.limits_of(name);
  if (joint == joints.end() || limit == nullptr) return target_rad;
  const runtime::JointStatus& look = joint->look;
  const double from_rad =
      std::isfinite(look.commanded_rad) ? look.commanded_rad : look.position_rad;
  const double turns = std::round((from_rad - target_rad) / kTurn_rad);
  const double nearest = target_rad + turns * kTurn_rad;
  return hal::reaches(*limit, nearest) ? nearest : target_rad;
}

Result<Json> move(const Run& run, const Json& request) {
  const auto joint = request["joint"].get<std::string>();
  const hal::JointCapabilities* limit = run.limits_of(joint);
  if (limit != nullptr && request.contains("unit")) {
    const Status fits = check_unit(joint, limit->slides, request["unit"].get<std::string>());
    if (!fits) return std::unexpected(fits.error());
  }
  runtime::MoveRequest wish{.target_rad = request["target_rad"].get<double>()};
  wish.speed_rad_s = request.value("speed_rad_s", wish.speed_rad_s);
  wish.acceleration_rad_s2 = request.value("acceleration_rad_s2", wish.acceleration_rad_s2);
  if (request.value("shortest", false)) {
    if (limit != nullptr && limit->slides)
      return fail_at(joint, "this joint slides", "leave out shortest");
    wish.target_rad = shortest(run, joint, wish.target_rad);
  }
  Result<Json> answer = tell(run, joint, run.cycle.services().move_joint(joint, wish));
  if (answer) (*answer)["target_rad"] = wish.target_rad;
  return answer;
}

/// Brakes what an operator leads; a joint of a controller is that one's. A joint that refuses keeps
/// no other one moving: its error comes after the others were asked.
Result<Json> halt(const Run& run) {
  Json halted = Json::array();
  bool done = true;
  std::uint64_t cycle = 0;
  Status refused;
  for (const runtime::JointInfo& joint : run.cycle.services().joints()) {
    const bool homes = joint.look.homing.state == hal::HomingState::kHoming;
    if (!joint.owner.empty() || (joint.look.moving == 0 && !homes)) continue;
    const auto asked = run.cycle.services().move_joint(joint.name, {});
    if (!asked) {
      if (refused) refused = std::unexpected(asked.error());
      continue;
    }
    done = done && asked->done;
    cycle = asked->cycle;
    halted.push_back(joint.name);
  }
  if (!refused) return std::unexpected(refused.error());
  if (halted.empty()) {
    return Json{{"done", true},
                {"note", "nothing has moved by joint move, home or recover"},
                {"joints", std::move(halted)}};
  }
  return Json{{"done", done}, {"cycle", cycle}, {"joints", std::move(halted)}};
}

Result<Json> reset(const Run& run, const std::string& name) {
  const auto joints = run.cycle.services().joints();
  const auto joint = std::ranges::find(joints, name, &runtime::JointInfo::name);
  const bool latched = joint != joints.end() && joint->look.fault != 0;
  Result<Json> answer = tell(run, name, run.cycle.services().reset_joint(name));
  if (!answer) return answer;
  (*answer)["latched"] = latched;
  if (answer->value("done", false)) answer->erase("note");  // its drive is nobody's
  return answer;
}

/// The gains that a joint will have, but for what is asked now.
std::array<hal::PidGains, hal::kPidLoops> gains_to_come(Run& run, const runtime::JointInfo& joint,
                                                        std::size_t index) {
  std::array<hal::PidGains, hal::kPidLoops> gains = joint.gains;
  for (const hal::PidLoop loop : kLoops) {
    const auto waits = run.waiting.find({index, loop});
    if (waits == run.waiting.end()) continue;
    hal::PidGains& shown = gains[static_cast<std::size_t>(loop)];
    if (shown == waits->second) {
      run.waiting.erase(waits);
    } else {
      shown = waits->second;
    }
  }
  return gains;
}

/// What people read of it.
std::string told(const Json& stability) {
  if (!stability["judged"].get<bool>()) {
    return "not judged against the model: " + stability["why"].get<std::string>();
  }
  const std::string loop = stability["loop"].get<std::string>() + " loop";
  if (!stability["stable"].get<bool>()) {
    return fmt::format("warning: the {} is unstable, it doubles in {:.2g} s", loop,
                       stability["doubles_in_s"].get<double>());
  }
  if (stability["phase_margin_deg"].is_null()) return loop + ": stable, its gain stays below 1";
  const double margin_deg = stability["phase_margin_deg"];
  return fmt::format("{}{}: phase margin {:.0f} deg at {:.3g} rad/s",
                     margin_deg < kLowMargin_deg ? "warning: it may swing; " : "", loop, margin_deg,
                     stability["crossover_rad_s"].get<double>());
}

/// What the model says of a wish, once it is complete; unstable gains are refused.
/// @param[out] wanted  all gains of the joint
Result<Json> judged(Run& run, const std::string& name, hal::PidLoop loop,
                    const runtime::GainsRequest& wish, bool anyway, hal::PidGains& wanted) {
  const Json unknown{{"judged", false}, {"why", "this process has no model of the robot"}};
  const int index = run.robot.joint_index(name);
  if (index < 0) return unknown;  // which the run itself refuses
  const auto j = static_cast<std::size_t>(index);
  const auto joints = run.cycle.services().joints();
  auto gains = gains_to_come(run, joints[j], j);
  hal::PidGains& of = gains[static_cast<std::size_t>(loop)];
  of = {wish.kp.value_or(of.kp), wish.ki.value_or(of.ki), wish.kd.value_or(of.kd)};
  wanted = of;
  if (!run.judge) return unknown;
  std::vector<double> position_rad;
  for (const runtime::JointInfo& joint : joints) position_rad.push_back(joint.look.position_rad);
  Json stability = run.judge(j, loop, gains, position_rad);
  if (anyway || stability.value("stable", true)) return stability;
  const std::string remedy = stability.value("remedy", "");
  return fail_at(
      name,
      fmt::format("with kp = {:g}, ki = {:g}, kd = {:g} the {} loop is unstable: with an "
                  "inertia of {:.3g} {} it doubles in {:.2g} s",
                  of.kp, of.ki, of.kd, stability["loop"].get<std::string>(),
                  stability["inertia_kg_m2"].get<double>(), joints[j].slides ? "kg" : "kg m2",
                  stability["doubles_in_s"].get<double>()),
      (remedy.empty() ? "" : remedy + "; ") + "--anyway (\"anyway\": true) sets them nevertheless");
}

Result<Json> set_gains(Run& run, const Json& request) {
  const auto joint = request["joint"].get<std::string>();
  const hal::PidLoop loop = choice(request["loop"], kLoops);
  runtime::GainsRequest wish;
  if (request.contains("kp")) wish.kp = request["kp"].get<double>();
  if (request.contains("ki")) wish.ki = request["ki"].get<double>();
  if (request.contains("kd")) wish.kd = request["kd"].get<double>();
  if (!wish.kp && !wish.ki && !wish.kd) {
    return fail("joint.gains: nothing is to be set", "give kp, ki or kd");
  }
  if (Status fits = run.cycle.services().check_gains(joint, loop, wish); !fits) {
    return std::unexpected(fits.error());
  }
  hal::PidGains wanted;
  const auto stability = judged(run, joint, loop, wish, request.value("anyway", false), wanted);
  if (!stability) return stability;
  auto answer = tell(run, joint, run.cycle.services().set_gains(joint, loop, wish));
  if (!answer) return answer;
  const std::pair key{static_cast<std::size_t>(run.robot.joint_index(joint)), loop};
  if (answer->value("done", false)) {
    run.waiting.erase(key);
  } else {
    run.waiting[key] = wanted;
  }
  (*answer)["stability"] = *stability;
  // Gains are nobody's: not the note of the joint's owner.
  const std::string waits = answer->value("done", false) ? "" : answer->value("note", "") + "; ";
  (*answer)["note"] = waits + told(*stability);
  return answer;
}

}  // namespace

void add_joint_commands(ControlRegistry& registry, RobotCycle& cycle, const hal::RobotConfig& robot,
                        JudgeGains judge) {
  const auto run =
      std::make_shared<Run>(Run{cycle, robot, hal::joint_capabilities(robot),
                                hal::motor_feedback(robot), modes_of(robot), std::move(judge)});
  registry.add("joint.list", [run](const Json&) -> Result<Json> { return list(*run); });
  registry.add("joint.set", [run](const Json& request) { return set(*run, request); });
  registry.add("joint.move", [run](const Json& request) { return move(*run, request); });
  registry.add("joint.stop", [run](const Json& request) {
    const auto name = request["joint"].get<std::string>();
    return tell(*run, name, run->cycle.services().move_joint(name, {}));
  });
  registry.add("joint.halt", [run](const Json&) { return halt(*run); });
  using Services = runtime::RunServices;
  const auto asks = [run](Result<runtime::RequestResult> (Services::*what)(const std::string&,
                                                                           Services::Patience)) {
    return [run, what](const Json& request) {
      const auto name = request["joint"].get<std::string>();
      return tell(*run, name, (run->cycle.services().*what)(name, Services::kPatience));
    };
  };
  registry.add("joint.home", asks(&Services::home_joint));
  registry.add("joint.recover", asks(&Services::recover));
  registry.add("joint.reset", [run](const Json& request) {
    return reset(*run, request["joint"].get<std::string>());
  });
  registry.add("joint.gains", [run](const Json& request) { return set_gains(*run, request); });
}

}  // namespace tandem::apps
