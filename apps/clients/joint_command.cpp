// tandem joint: what it asks a running run, and its answer.
#include <fmt/core.h>

#include <charconv>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <string_view>
#include <thread>
#include <tuple>
#include <vector>

#include "apps/clients/commands.hpp"
#include "apps/clients/control_client.hpp"
#include "apps/clients/joint_print.hpp"
#include "apps/clients/named.hpp"
#include "apps/text/console.hpp"
#include "base/quoting.hpp"
#include "rt/stop_signal.hpp"

namespace tandem::apps {
namespace {

constexpr double kDegPerRad = 180.0 / std::numbers::pi;

// Tolerance once a joint's reference has arrived: what is measured farther off is reported.
constexpr double kFar_rad = 1.0 / kDegPerRad;
constexpr double kFar_m = 0.01;

struct Unit {
  const char* name;
  double si;         ///< one of it, in SI units
  const char* kind;  ///< for the run, which knows whether the joint turns or slides
};

std::string_view without_blanks_around(std::string_view text) {
  const std::size_t first = text.find_first_not_of(' ');
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(' ') - first + 1);
}

/// Adds `text`, such as "30deg" or "30 deg" with `per` "", "20deg/s" with "/s", to the question.
Status add_quantity(Json& question, const char* key, const char* flag, const std::string& text,
                    const std::string& per) {
  if (text.empty()) return {};
  double number = 0.0;
  std::string_view trimmed = without_blanks_around(text);
  // std::from_chars() knows no plus sign.
  if (trimmed.starts_with('+') && !trimmed.starts_with("+-")) trimmed.remove_prefix(1);
  const char* last = trimmed.data() + trimmed.size();
  const auto [end, error] = std::from_chars(trimmed.data(), last, number);
  const std::string_view unit = without_blanks_around({end, last});
  const auto wrong = [&] {
    return fail_at(
        flag, fmt::format("'{}' is no number with a unit", text),
        fmt::format("write 30deg{0}, 0.5rad{0}, 20mm{0}, 2cm{0}, 0.02m{0}, or a number in SI units",
                    per));
  };
  const bool read = error == std::errc();
  if (error == std::errc::result_out_of_range || (read && !std::isfinite(number))) {
    return fail_at(flag, fmt::format("'{}' is not finite", text), "give a finite number");
  }
  if (!read) return wrong();
  question[key] = number;
  if (unit.empty()) return {};
  for (const Unit& known : {Unit{"deg", std::numbers::pi / 180.0, "angle"},
                            {"rad", 1.0, "angle"},
                            {"mm", 1e-3, "length"},
                            {"cm", 1e-2, "length"},
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

/// Whether there is something to do.
Status check_asked(const JointOptions& o) {
  if (o.action == JointOptions::Action::kSet && o.mode.empty() && o.interaction.empty() &&
      !o.stiffness_Nm_rad && !o.damping_Nms_rad) {
    return fail("nothing is to be set", "give --mode, --interaction, --stiffness or --damping");
  }
  if (o.action == JointOptions::Action::kGains && !o.kp && !o.ki && !o.kd) {
    return fail("nothing is to be set", "give --kp, --ki or --kd");
  }
  return {};
}

Result<Json> question_of(const JointOptions& o) {
  if (Status asked = check_asked(o); !asked) return std::unexpected(asked.error());
  Json question{{"do", "joint.list"}};
  switch (o.action) {
    case JointOptions::Action::kList:
    case JointOptions::Action::kShow: return question;
    case JointOptions::Action::kSet: question["do"] = "joint.set"; break;
    case JointOptions::Action::kMove: question["do"] = "joint.move"; break;
    case JointOptions::Action::kStop: question["do"] = "joint.stop"; break;
    case JointOptions::Action::kHome: question["do"] = "joint.home"; break;
    case JointOptions::Action::kRecover: question["do"] = "joint.recover"; break;
    case JointOptions::Action::kReset: question["do"] = "joint.reset"; break;
    case JointOptions::Action::kGains: question["do"] = "joint.gains"; break;
  }
  question["joint"] = o.joint;
  if (o.shortest) question["shortest"] = true;
  if (!o.mode.empty()) question["mode"] = o.mode;
  if (!o.interaction.empty()) question["interaction"] = o.interaction;
  if (o.stiffness_Nm_rad) question["stiffness_Nm_rad"] = *o.stiffness_Nm_rad;
  if (o.damping_Nms_rad) question["damping_Nms_rad"] = *o.damping_Nms_rad;
  if (!o.loop.empty()) question["loop"] = o.loop;
  if (o.kp) question["kp"] = *o.kp;
  if (o.ki) question["ki"] = *o.ki;
  if (o.kd) question["kd"] = *o.kd;
  if (o.anyway) question["anyway"] = true;
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

/// Whether the target was written in degrees: it is shown in them, too.
bool in_degrees(const JointOptions& options) { return options.to.find("deg") != std::string::npos; }

/// @param answer  the joint after the stop, where the stop is `done`
const char* outcome_of_stop(bool done, const Json& answer) {
  if (!done) return "brakes then; a motion that has not begun is taken back";
  return answer.value("moving", false) ? "brakes, and stays where it comes to rest" : "is at rest";
}

void print_answer(const JointOptions& options, const Json& answer, const Json& question) {
  using Action = JointOptions::Action;
  if (options.action == Action::kList) {
    const Json& joints = answer["joints"];
    options.gains    ? print_gains(joints)
    : options.drives ? print_drives(joints)
                     : print_joints(joints);
    return;
  }
  if (options.action == Action::kShow) return print_joint(answer);
  const bool done = answer.value("done", false) && options.action != Action::kReset;
  if (done) fmt::print("done in cycle {}\n", answer.value("cycle", 0));
  if (answer.contains("note")) fmt::print("{}\n", shown(answer.value("note", ""), 2'000));
  switch (options.action) {
    case Action::kList:
    case Action::kShow: break;
    case Action::kReset:
      if (!answer.value("latched", false)) {
        fmt::print(
            "{}: its drive has no fault; what the run has latched stays until `tandem fault "
            "reset`\n",
            options.joint);
      }
      break;
    case Action::kGains: print_gains(Json::array({answer})); break;
    case Action::kMove:
      fmt::print("{} {} from {} to {}: tandem joint list {}\n", options.joint,
                 done ? "moves" : "will move",
                 place_of(answer, answer["position_rad"], in_degrees(options)),
                 place_of(answer, question["target_rad"], in_degrees(options)), options.joint);
      break;
    case Action::kStop: fmt::print("{} {}\n", options.joint, outcome_of_stop(done, answer)); break;
    case Action::kHome:
      fmt::print("{}: its drive {} for its place: tandem joint show {}\n", options.joint,
                 done ? "looks" : "will look", options.joint);
      break;
    case Action::kRecover:
      fmt::print("{} comes back from {} {} to its limit: tandem joint list {}\n", options.joint,
                 number_of(answer, "position_rad"), unit_of(answer), options.joint);
      break;
    case Action::kSet: {
      Facts facts;
      facts.add("mode", mode_of(answer));
      const std::string torque = torque_unit_of(answer), unit = unit_of(answer);
      facts.add("stiffness", number_of(answer, "stiffness_Nm_rad") + " " + torque + "/" + unit);
      facts.add("damping", number_of(answer, "damping_Nms_rad") + " " + torque + "s/" + unit);
      facts.print(stdout);
    }
  }
}

/// The joint, and the cycle of what is said of it.
Result<Json> look(ControlClient& run, const std::string& name) {
  const Result<Json> answer = run.ask({{"do", "joint.list"}});
  if (!answer) return answer;
  const Result<Json> joint = named((*answer)["joints"], "joint", {name});
  if (!joint) return joint;
  Json found = joint->front();
  found["cycle"] = (*answer)["cycle"];
  return found;
}

constexpr std::chrono::milliseconds kLook{20};  // between two

/// The joint once its motion has ended, and its reference has come to rest; after Ctrl-C at once.
/// @param begun  whether the loop has taken the request; set when it has in the meantime
Result<Json> wait_for_motion(ControlClient& run, const std::string& name, double target,
                             bool& begun) {
  Json before;
  for (;;) {
    Result<Json> now = look(run, name);
    if (!now || !(*now)["commanded_position_rad"].is_number()) return now;
    const double reference = (*now)["commanded_position_rad"];
    (*now)["arrived"] = std::abs(reference - target) < 1e-6;
    const bool cycled = !before.is_null() && before["cycle"] != (*now)["cycle"];
    begun = begun || cycled;
    const bool rests =
        cycled && before["commanded_position_rad"] == (*now)["commanded_position_rad"];
    // The reference of a drive that is not enabled follows the joint, which may swing for long.
    const bool led = now->value("drive_state", "") == "operation enabled";
    const bool over = now->value("arrived", false) || rests || (begun && !led);
    if (!now->value("moving", false) && over) return now;
    if (rt::stop_requested()) return now;
    before = *now;
    std::this_thread::sleep_for(kLook);
  }
}

/// The joint once the reset of its drive is through.
Result<Json> wait_for_reset(ControlClient& run, const std::string& name) {
  for (;;) {
    Result<Json> now = look(run, name);
    if (!now || !now->value("resetting", false)) return now;
    std::this_thread::sleep_for(kLook);
  }
}

/// The joint once its homing has ended and it is within its limits; after Ctrl-C at once.
Result<Json> wait_for_homing(ControlClient& run, const std::string& name) {
  for (;;) {
    Result<Json> now = look(run, name);
    if (!now || rt::stop_requested()) return now;
    const bool led = now->value("homing", "") == "homed" && now->value("moving", false);
    if (now->value("homing", "") != "under way" && !led) return now;
    std::this_thread::sleep_for(kLook);
  }
}

/// The reference has arrived: what is measured may lag, or rest against something.
void warn_if_far(const JointOptions& options, const Json& joint) {
  if (!joint["position_rad"].is_number()) return;
  const double off =
      std::abs(joint["position_rad"].get<double>() - joint["commanded_position_rad"].get<double>());
  if (off <= (slides(joint) ? kFar_m : kFar_rad)) return;
  print_warnings(
      {{.message = fmt::format("what is measured is {} off", place_of(joint, off, !slides(joint))),
        .hint = "it lags, or something holds it: tandem joint show " + options.joint,
        .file = {},
        .key = options.joint}});
}

/// What came of a motion that was waited for.
/// @param begun  false: Ctrl-C ended the waiting before the loop took the request
Exit tell_motion(const JointOptions& options, const Json& joint, double target, bool begun) {
  const bool degrees = in_degrees(options);
  const std::string at = place_of(joint, joint["commanded_position_rad"], degrees) + ", measured " +
                         place_of(joint, joint["position_rad"], degrees);
  if (joint.value("arrived", false)) {
    if (options.json != "-") fmt::print("{} has arrived: {}\n", options.joint, at);
    std::fflush(stdout);  // before the warning
    warn_if_far(options, joint);
    return Exit::kDone;
  }
  if (joint.value("moving", false)) {  // Ctrl-C
    fmt::print(stderr, "{0} still moves to {1}: `tandem joint stop {0}` brakes it\n", options.joint,
               place_of(joint, target, degrees));
    return Exit::kFault;
  }
  if (!begun) {
    fmt::print(stderr,
               "{0} has not begun to move to {1}: it begins when the run goes on (tandem clock "
               "resume); `tandem joint stop {0}` takes the motion back\n",
               options.joint, place_of(joint, target, degrees));
    return Exit::kFault;
  }
  const std::string owner = joint.value("controller", "");
  const bool enabled = joint.value("drive_state", "") == "operation enabled";
  Error error{.message = fmt::format("its motion to {} has ended at {}",
                                     place_of(joint, target, degrees), at),
              .hint = "it was stopped, or sent elsewhere: tandem joint show " + options.joint,
              .file = {},
              .key = options.joint};
  if (!owner.empty()) error.hint = fmt::format("the controller '{}' has it now", owner);
  if (!enabled) error.hint = "its drive is not enabled any more: tandem fault show";
  print_errors({error});
  return Exit::kFault;
}

/// What came of the reset of a drive.
Exit tell_reset(const JointOptions& options, const Json& joint) {
  if (const std::string fault = joint.value("fault_text", ""); !fault.empty()) {
    print_errors({{.message = fmt::format("the reset failed, its cause is still there: {}", fault),
                   .hint = "remove the cause, then `tandem joint reset " +
                           shell_word(options.joint) + "` again",
                   .file = {},
                   .key = options.joint}});
    return Exit::kFault;
  }
  if (options.json == "-") return Exit::kDone;
  if (joint.value("drive_state", "") == "operation enabled") {
    fmt::print("{}: its fault is cleared, and it is held where it is\n", options.joint);
  } else {
    fmt::print(
        "{}: its fault is cleared, its drive stays disabled: `tandem fault reset` enables every "
        "joint where it is\n",
        options.joint);
  }
  return Exit::kDone;
}

/// What came of a homing.
Exit tell_homing(const JointOptions& options, const Json& joint) {
  const std::string state = joint.value("homing", "");
  if (state == "homed") {
    if (options.json == "-") return Exit::kDone;
    fmt::print("{} is homed: it is at {}\n", options.joint,
               place_of(joint, joint["position_rad"], !slides(joint)));
    return Exit::kDone;
  }
  if (state == "under way") {  // Ctrl-C
    fmt::print(stderr, "{0} is still being homed: `tandem joint stop {0}` ends that\n",
               options.joint);
    return Exit::kFault;
  }
  const Json method = joint.value("homing_method", Json());
  const std::string which =
      method.is_number() ? fmt::format("(method {}) ", method.get<int>()) : std::string();
  const std::string advice = joint.value("homing_advice", "");
  print_errors({{.message = "the homing " + which + "failed: " + joint.value("homing_error", ""),
                 .hint = (advice.empty() ? "" : advice + "; ") + "tandem joint home " +
                         options.joint + " tries again",
                 .file = {},
                 .key = options.joint}});
  return Exit::kFault;
}

/// list and show: those joints that are named.
Exit show(const JointOptions& options, Json answer) {
  const bool one = options.action == JointOptions::Action::kShow;
  const std::vector<std::string> names = one ? std::vector{options.joint} : options.joints;
  const Json followers = answer.value("followers", Json::object());
  for (const std::string& name : names) {
    if (!followers.contains(name)) continue;
    const auto leader = followers[name].get<std::string>();
    return refuse(Error{"the joint '" + name + "' follows '" + leader + "' (mimic)",
                        "name '" + leader + "'",
                        {},
                        0,
                        {}});
  }
  const Result<Json> some = named(answer["joints"], "joint", names);
  if (!some) return refuse(some.error());
  answer["joints"] = *some;
  if (one) answer = some->front();
  if (options.json != "-") print_answer(options, answer, {});
  if (Status written = write_json(options.json, answer); !written) return refuse(written.error());
  return Exit::kDone;
}

}  // namespace

Exit joint_command(const JointOptions& options) {
  using Action = JointOptions::Action;
  Result<Json> question = question_of(options);
  if (!question) return refuse(question.error());
  const auto run = ControlClient::open(options.target, "run");
  if (!run) return refuse(run.error());
  const bool moves = options.action == Action::kMove && options.wait;
  const bool homes = options.action == Action::kHome;
  if (moves || homes) rt::install_stop_signals();
  const Result<Json> asked = (*run)->ask(*question);
  if (!asked) return refuse(asked.error());
  Json answer = *asked;
  if (answer.contains("target_rad")) (*question)["target_rad"] = answer["target_rad"];
  if (answer.contains("joints")) return show(options, answer);
  if (options.json != "-") print_answer(options, answer, *question);
  Exit exit = Exit::kDone;
  const bool resets = options.action == Action::kReset && answer.value("latched", false) &&
                      answer.value("done", false);
  bool begun = answer.value("done", false);
  if (moves || resets || (homes && begun)) {
    std::fflush(stdout);  // before the waiting
    const Result<Json> joint =
        moves   ? wait_for_motion(**run, options.joint, (*question)["target_rad"], begun)
        : homes ? wait_for_homing(**run, options.joint)
                : wait_for_reset(**run, options.joint);
    if (!joint) {
      print_errors({joint.error()});
      return Exit::kFault;
    }
    for (const auto& [key, value] : joint->items()) {
      if (key != "cycle") answer[key] = value;  // that of the request stays
    }
    exit = moves   ? tell_motion(options, *joint, (*question)["target_rad"], begun)
           : homes ? tell_homing(options, *joint)
                   : tell_reset(options, *joint);
  }
  if (Status written = write_json(options.json, answer); !written) return refuse(written.error());
  return exit;
}

}  // namespace tandem::apps
