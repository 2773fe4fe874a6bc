// tandem joint: what it asks a running run, and its answer.
#include <fmt/core.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numbers>
#include <tuple>

#include "apps/clients/commands.hpp"
#include "apps/clients/control_client.hpp"
#include "apps/text/console.hpp"
#include "base/nearest.hpp"
#include "runtime/robot_cycle.hpp"

namespace tandem::apps {
namespace {

std::string number(const Json& joint, const char* key) {
  return joint[key].is_number() ? fmt::format("{:.4g}", joint[key].get<double>()) : "-";
}

/// "position", or "position (idle)" while the drive is not there yet.
std::string mode_of(const Json& joint) {
  const std::string mode = joint.value("mode", "");
  const std::string in_force = joint.value("mode_in_force", "");
  const std::string yields = joint.value("interaction", "") == "compliant" ? ", compliant" : "";
  return mode + yields + (in_force == mode ? "" : " (" + in_force + ")");
}

/// Its state and fault; of a drive that is not heard, whose figures are old, that alone.
std::string drive_of(const Json& joint) {
  const auto age_cycles = joint.value("age_cycles", 0U);
  if (age_cycles > runtime::CycleConfig().lost_after_cycles)
    return fmt::format("no feedback for {} cycles", age_cycles);
  const auto fault = joint.value("fault", 0U);
  const std::string state = joint.value("drive_state", "");
  return fault == 0 ? state : fmt::format("{} (0x{:04X})", state, fault);
}

void print_joints(const Json& joints) {
  Table table({"joint", "controller", "mode", "position [rad]", "velocity [rad/s]", "torque [Nm]",
               "drive"});
  for (const Json& joint : joints) {
    const std::string owner = joint.value("controller", "");
    table.add({joint.value("joint", ""), owner.empty() ? "-" : owner, mode_of(joint),
               number(joint, "position_rad"), number(joint, "velocity_rad_s"),
               number(joint, "torque_Nm"), drive_of(joint)});
  }
  table.print(stdout);
}

void print_drives(const Json& joints) {
  Table table({"joint", "motor [rad]", "current [A]", "voltage [V]", "winding [degC]", "drive"});
  for (const Json& joint : joints) {
    table.add({joint.value("joint", ""), number(joint, "motor_position_rad"),
               number(joint, "current_A"), number(joint, "voltage_V"),
               number(joint, "temperature_C"), drive_of(joint)});
  }
  table.print(stdout);
}

void print_gains(const Json& joints) {
  Table table({"joint", "loop", "kp", "ki", "kd"});
  for (const Json& joint : joints) {
    for (const auto& [loop, gains] : joint["gains"].items()) {
      table.add({joint.value("joint", ""), loop, number(gains, "kp"), number(gains, "ki"),
                 number(gains, "kd")});
    }
  }
  table.print(stdout);
}

/// The joints of `wanted`, in its order; all when it is empty.
Result<Json> only(const Json& joints, const std::vector<std::string>& wanted) {
  if (wanted.empty()) return joints;
  std::vector<std::string> names;
  for (const Json& joint : joints) names.push_back(joint.value("joint", ""));
  Json some = Json::array();
  for (const std::string& name : wanted) {
    const auto found = std::ranges::find(names, name);
    if (found == names.end()) {
      return fail(fmt::format("the robot has no joint '{}'", name), suggest(name, names));
    }
    some.push_back(joints[static_cast<std::size_t>(found - names.begin())]);
  }
  return some;
}

struct Unit {
  const char* name;
  double si;         ///< one of it, in SI units
  const char* kind;  ///< for the run, which knows whether the joint turns or slides
};

/// Adds `text`, such as "30deg" with `per` "" or "20deg/s" with `per` "/s", to the question.
Status add_quantity(Json& question, const char* key, const char* flag, const std::string& text,
                    const std::string& per) {
  if (text.empty()) return {};
  double number = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  const std::string unit(end, text.data() + text.size());
  const auto wrong = [&] {
    return fail_at(
        flag, fmt::format("'{}' is no number with a unit", text),
        fmt::format("write 30deg{0}, 0.5rad{0}, 20mm{0}, 0.02m{0}, or a number in SI units", per));
  };
  if (error != std::errc() || !std::isfinite(number)) return wrong();
  question[key] = number;
  if (unit.empty()) return {};
  for (const Unit& known : {Unit{"deg", std::numbers::pi / 180.0, "angle"},
                            {"rad", 1.0, "angle"},
                            {"mm", 1e-3, "length"},
                            {"m", 1.0, "length"}}) {
    if (unit != known.name + per) continue;
    question[key] = number * known.si;
    if (question.value("unit", known.kind) != known.kind) {
      return fail_at(flag, fmt::format("'{}' is of another kind than the other values", text),
                     "give angles or lengths, not both");
    }
    question["unit"] = known.kind;
    return {};
  }
  return wrong();
}

Result<Json> question_of(const JointOptions& o) {
  Json question{{"do", "joint.list"}};
  switch (o.action) {
    case JointOptions::Action::kList: return question;
    case JointOptions::Action::kSet: question["do"] = "joint.set"; break;
    case JointOptions::Action::kMove: question["do"] = "joint.move"; break;
    case JointOptions::Action::kStop: question["do"] = "joint.stop"; break;
    case JointOptions::Action::kRecover: question["do"] = "joint.recover"; break;
    case JointOptions::Action::kGains: question["do"] = "joint.gains"; break;
  }
  question["joint"] = o.joint;
  if (!o.mode.empty()) question["mode"] = o.mode;
  if (!o.interaction.empty()) question["interaction"] = o.interaction;
  if (o.stiffness_Nm_rad) question["stiffness_Nm_rad"] = *o.stiffness_Nm_rad;
  if (o.damping_Nms_rad) question["damping_Nms_rad"] = *o.damping_Nms_rad;
  if (!o.loop.empty()) question["loop"] = o.loop;
  if (o.kp) question["kp"] = *o.kp;
  if (o.ki) question["ki"] = *o.ki;
  if (o.kd) question["kd"] = *o.kd;
  for (const auto& [key, flag, text, per] :
       {std::tuple{"target_rad", "--to", &o.to, ""},
        {"speed_rad_s", "--speed", &o.speed, "/s"},
        {"acceleration_rad_s2", "--acceleration", &o.acceleration, "/s2"}}) {
    if (Status added = add_quantity(question, key, flag, *text, per); !added) {
      return std::unexpected(added.error());
    }
  }
  return question;
}

void print_answer(const JointOptions& options, const Json& answer) {
  if (answer.contains("joints")) {
    const Json& joints = answer["joints"];
    options.gains    ? print_gains(joints)
    : options.drives ? print_drives(joints)
                     : print_joints(joints);
    return;
  }
  if (answer.value("done", false)) fmt::print("done in cycle {}\n", answer.value("cycle", 0));
  if (answer.contains("note")) fmt::print("{}\n", answer.value("note", ""));
  if (options.action == JointOptions::Action::kGains) {
    print_gains(Json::array({answer}));
    return;
  }
  if (options.action == JointOptions::Action::kMove) {
    fmt::print("{} moves from {} to {}: tandem joint list {}\n", options.joint,
               number(answer, "position_rad"), options.to, options.joint);
    return;
  }
  if (options.action == JointOptions::Action::kStop) {
    fmt::print("{} brakes, and stays where it comes to rest\n", options.joint);
    return;
  }
  if (options.action == JointOptions::Action::kRecover) {
    fmt::print("{} comes back from {} rad to its limit: tandem joint list {}\n", options.joint,
               number(answer, "position_rad"), options.joint);
    return;
  }
  Facts facts;
  facts.add("mode", mode_of(answer));
  facts.add("stiffness", number(answer, "stiffness_Nm_rad") + " Nm/rad");
  facts.add("damping", number(answer, "damping_Nms_rad") + " Nms/rad");
  facts.print(stdout);
}

}  // namespace

Exit joint_command(const JointOptions& options) {
  const Result<Json> question = question_of(options);
  if (!question) return refuse(question.error());
  Result<Json> answer = ask(options.target, "run", *question);
  if (!answer) return refuse(answer.error());
  if (answer->contains("joints")) {
    const Result<Json> some = only((*answer)["joints"], options.joints);
    if (!some) return refuse(some.error());
    (*answer)["joints"] = *some;
  }
  if (options.json != "-") print_answer(options, *answer);
  if (Status written = write_json(options.json, *answer); !written) return refuse(written.error());
  return Exit::kDone;
}

}  // namespace tandem::apps
