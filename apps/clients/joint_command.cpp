// tandem joint: what it asks a running run, and its answer.
#include <fmt/core.h>

#include <chrono>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <string_view>
#include <thread>
#include <vector>

#include "apps/clients/asked.hpp"
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

std::string joint_of(const Asked& asked) { return asked.text("joint"); }

/// Whether the target was written in degrees: it is shown in them, too.
bool in_degrees(const Asked& asked) {
  return asked.text("target_rad").find("deg") != std::string::npos;
}

/// The joint, and the cycle of what is said of it.
Result<Json> look(ControlClient& run, const std::string& name) {
  Result<Json> answer = run.ask({{"do", "joint.list"}});
  // Ctrl-C ends the waiting, which still says where the joint is.
  if (!answer && rt::stop_requested()) answer = run.ask({{"do", "joint.list"}});
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
void warn_if_far(const Asked& asked, const Json& joint) {
  if (!joint["position_rad"].is_number() || !joint["commanded_position_rad"].is_number()) return;
  const double off =
      std::abs(joint["position_rad"].get<double>() - joint["commanded_position_rad"].get<double>());
  if (off <= (slides(joint) ? kFar_m : kFar_rad)) return;
  print_warnings(
      {{.message = fmt::format("what is measured is {} off", place_of(joint, off, !slides(joint))),
        .hint = "it lags, or something holds it: tandem joint show " + joint_of(asked),
        .file = {},
        .key = joint_of(asked)}});
}

/// What came of a motion that was waited for.
/// @param begun  false: Ctrl-C ended the waiting before the loop took the request
Exit tell_end_of_motion(const Asked& asked, const Json& joint, double target, bool begun) {
  const bool degrees = in_degrees(asked);
  const std::string at = place_of(joint, joint["commanded_position_rad"], degrees) + ", measured " +
                         place_of(joint, joint["position_rad"], degrees);
  if (joint.value("arrived", false)) {
    if (asked.prints()) fmt::print("{} has arrived: {}\n", joint_of(asked), at);
    std::fflush(stdout);  // before the warning
    warn_if_far(asked, joint);
    return Exit::kDone;
  }
  if (joint.value("moving", false)) {  // Ctrl-C
    fmt::print(stderr, "{0} still moves to {1}: `tandem joint stop {0}` brakes it\n",
               joint_of(asked), place_of(joint, target, degrees));
    return Exit::kFault;
  }
  if (!begun) {
    fmt::print(stderr,
               "{0} has not begun to move to {1}: it begins when the run goes on (tandem clock "
               "resume); `tandem joint stop {0}` takes the motion back\n",
               joint_of(asked), place_of(joint, target, degrees));
    return Exit::kFault;
  }
  const std::string owner = joint.value("controller", "");
  const bool enabled = joint.value("drive_state", "") == "operation enabled";
  Error error{.message = fmt::format("its motion to {} has ended at {}",
                                     place_of(joint, target, degrees), at),
              .hint = "it was stopped, or sent elsewhere: tandem joint show " + joint_of(asked),
              .file = {},
              .key = joint_of(asked)};
  if (!owner.empty()) error.hint = fmt::format("the controller '{}' has it now", owner);
  if (!enabled) error.hint = "its drive is not enabled any more: tandem fault show";
  print_errors({error});
  return Exit::kFault;
}

/// What came of the reset of a drive.
Exit tell_end_of_reset(const Asked& asked, const Json& joint) {
  if (const std::string fault = joint.value("fault_text", ""); !fault.empty()) {
    print_errors({{.message = fmt::format("the reset failed, its cause is still there: {}", fault),
                   .hint = "remove the cause, then `tandem joint reset " +
                           shell_word(joint_of(asked)) + "` again",
                   .file = {},
                   .key = joint_of(asked)}});
    return Exit::kFault;
  }
  if (!asked.prints()) return Exit::kDone;
  if (joint.value("drive_state", "") == "operation enabled") {
    fmt::print("{}: its fault is cleared, and it is held where it is\n", joint_of(asked));
  } else {
    fmt::print(
        "{}: its fault is cleared, its drive stays disabled: `tandem fault reset` enables every "
        "joint where it is\n",
        joint_of(asked));
  }
  return Exit::kDone;
}

/// What came of a homing.
Exit tell_end_of_homing(const Asked& asked, const Json& joint) {
  const std::string state = joint.value("homing", "");
  if (state == "homed") {
    if (!asked.prints()) return Exit::kDone;
    fmt::print("{} is homed: it is at {}\n", joint_of(asked),
               place_of(joint, joint["position_rad"], !slides(joint)));
    return Exit::kDone;
  }
  if (state == "under way") {  // Ctrl-C
    fmt::print(stderr, "{0} is still being homed: `tandem joint stop {0}` ends that\n",
               joint_of(asked));
    return Exit::kFault;
  }
  const Json method = joint.value("homing_method", Json());
  const std::string which =
      method.is_number() ? fmt::format("(method {}) ", method.get<int>()) : std::string();
  const std::string advice = joint.value("homing_advice", "");
  print_errors({{.message = "the homing " + which + "failed: " + joint.value("homing_error", ""),
                 .hint = (advice.empty() ? "" : advice + "; ") + "tandem joint home " +
                         joint_of(asked) + " tries again",
                 .file = {},
                 .key = joint_of(asked)}});
  return Exit::kFault;
}

/// Takes what the joint is now into the answer; the cycle of the request stays.
void take(Asked& asked, const Json& joint) {
  for (const auto& [key, value] : joint.items()) {
    if (key != "cycle") asked.answer[key] = value;
  }
}

/// Nobody knows what came of it.
Exit not_known(const Error& error) {
  print_errors({error});
  return Exit::kFault;
}

/// Prints what every answer of a change has. @return whether more is to be printed
bool begin_to_tell(const Asked& asked) {
  if (asked.prints()) tell_done(asked.answer);
  return asked.prints();
}

}  // namespace

Status ask_for_list(const AskedOptions& options, Json&) {
  if (!options.given.contains("drives") || !options.given.contains("gains")) return {};
  return fail("--drives excludes --gains", "leave one out");
}

/// Its waiting ends with Ctrl-C.
Status ask_for_motion(const AskedOptions& options, Json&) {
  if (options.given.contains("wait") || options.row->name == "joint.home") {
    rt::install_stop_signals();
  }
  return {};
}

/// list and show: those joints that are named.
Result<Exit> tell_joints(Asked& asked) {
  const bool one = asked.options.given.contains("joint");
  const std::vector<std::string> names = one ? std::vector{joint_of(asked)} : asked.texts("joints");
  const Json followers = asked.answer.value("followers", Json::object());
  for (const std::string& name : names) {
    if (!followers.contains(name)) continue;
    const auto leader = followers[name].get<std::string>();
    return fail("the joint '" + name + "' follows '" + leader + "' (mimic)",
                "name '" + leader + "'");
  }
  const Result<Json> some = named(asked.answer["joints"], "joint", names);
  if (!some) return std::unexpected(some.error());
  if (one) {
    asked.answer = some->front();
  } else {
    asked.answer["joints"] = *some;
  }
  if (!asked.prints()) return Exit::kDone;
  one                   ? print_joint(asked.answer)
  : asked.has("gains")  ? print_gains(*some)
  : asked.has("drives") ? print_drives(*some)
                        : print_joints(*some);
  return Exit::kDone;
}

void print_joint_set(const Json& joint) {
  tell_done(joint);
  Facts facts;
  facts.add("mode", mode_of(joint));
  const std::string torque = torque_unit_of(joint), unit = unit_of(joint);
  facts.add("stiffness", number_of(joint, "stiffness_Nm_rad") + " " + torque + "/" + unit);
  facts.add("damping", number_of(joint, "damping_Nms_rad") + " " + torque + "s/" + unit);
  facts.print(stdout);
}

void print_joint_gains(const Json& joint) {
  tell_done(joint);
  print_gains(Json::array({joint}));
}

void print_joint_stop(const Json& joint) {
  tell_done(joint);
  const char* outcome = !joint.value("done", false)
                            ? "brakes then; a motion that has not begun is taken back"
                        : joint.value("moving", false) ? "brakes, and stays where it comes to rest"
                                                       : "is at rest";
  fmt::print("{} {}\n", joint.value("joint", ""), outcome);
}

void print_tuning(const Json& answer) { fmt::print("{}", answer.value("toml", "")); }

void print_recovery(const Json& joint) {
  tell_done(joint);
  fmt::print("{0} comes back from {1} {2} to its limit: tandem joint list {0}\n",
             joint.value("joint", ""), number_of(joint, "position_rad"), unit_of(joint));
}

Result<Exit> tell_motion(Asked& asked) {
  bool begun = asked.answer.value("done", false);
  const Json target = asked.answer.value("target_rad", asked.question["target_rad"]);
  if (begin_to_tell(asked)) {
    const bool degrees = in_degrees(asked);
    fmt::print("{} {} from {} to {}: tandem joint list {}\n", joint_of(asked),
               begun ? "moves" : "will move",
               place_of(asked.answer, asked.answer["position_rad"], degrees),
               place_of(asked.answer, target, degrees), joint_of(asked));
  }
  if (!asked.has("wait")) return Exit::kDone;
  std::fflush(stdout);  // before the waiting
  const Result<Json> joint = wait_for_motion(asked.run, joint_of(asked), target, begun);
  if (!joint) return not_known(joint.error());
  take(asked, *joint);
  return tell_end_of_motion(asked, *joint, target, begun);
}

Result<Exit> tell_homing(Asked& asked) {
  const bool done = asked.answer.value("done", false);
  if (begin_to_tell(asked)) {
    fmt::print("{}: its drive {} for its place: tandem joint show {}\n", joint_of(asked),
               done ? "looks" : "will look", joint_of(asked));
  }
  if (!done) return Exit::kDone;
  std::fflush(stdout);  // before the waiting
  const Result<Json> joint = wait_for_homing(asked.run, joint_of(asked));
  if (!joint) return not_known(joint.error());
  take(asked, *joint);
  return tell_end_of_homing(asked, *joint);
}

Result<Exit> tell_joint_reset(Asked& asked) {
  const bool latched = asked.answer.value("latched", false);
  if (asked.prints()) {
    if (asked.answer.contains("note")) {
      fmt::print("{}\n", shown(asked.answer.value("note", ""), 2'000));
    }
    if (!latched) {
      fmt::print(
          "{}: its drive has no fault; what the run has latched stays until `tandem fault "
          "reset`\n",
          joint_of(asked));
    }
  }
  if (!latched || !asked.answer.value("done", false)) return Exit::kDone;
  std::fflush(stdout);  // before the waiting
  const Result<Json> joint = wait_for_reset(asked.run, joint_of(asked));
  if (!joint) return not_known(joint.error());
  take(asked, *joint);
  return tell_end_of_reset(asked, *joint);
}

}  // namespace tandem::apps
