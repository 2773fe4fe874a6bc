#include "apps/control/command_rows.hpp"

#include <fmt/core.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "apps/control/control_registry.hpp"
#include "base/nearest.hpp"
#include "base/utf8.hpp"

namespace tandem::apps {
namespace {

using Type = ControlKey::Type;
using Unit = ControlKey::Unit;
using enum ControlEffect;

/// For CommandRow::More::answer_s. An emergency stop over DDS waits for dds.show.
constexpr int kStop_s = kStopAnswer / std::chrono::seconds(1);
/// A run of an hour may take minutes to be searched.
constexpr int kSearch_s = 600;
/// A library is tried, opened, and configured: each may take 4 s. Where one crashes, which is
/// tried, is looked for 25 s long.
constexpr int kLibrary_s = 40;

const char* to_string(Type type) {
  switch (type) {
    case Type::kText: return "text";
    case Type::kInteger: return "integer";
    case Type::kNumber: return "number";
    case Type::kBoolean: return "true or false";
    case Type::kObject: return "object";
    case Type::kTexts: return "list of texts";
    case Type::kNumbers: return "list of numbers";
    case Type::kTextOrObject: return "text or object";
  }
  return "?";
}

bool is_of(const Json& value, Type type) {
  switch (type) {
    case Type::kText: return value.is_string();
    case Type::kInteger: return value.is_number_integer();
    case Type::kNumber: return value.is_number();
    case Type::kBoolean: return value.is_boolean();
    case Type::kObject: return value.is_object();
    case Type::kTexts:
      return value.is_array() &&
             std::ranges::all_of(value, [](const Json& one) { return one.is_string(); });
    case Type::kNumbers:
      return value.is_array() &&
             std::ranges::all_of(value, [](const Json& one) { return one.is_number(); });
    case Type::kTextOrObject: return value.is_string() || value.is_object();
  }
  return false;
}

ControlKey text(const char* name, const char* line, const char* doc) {
  return {.name = name, .doc = doc, .line = line};
}
ControlKey number(const char* name, const char* line, const char* doc) {
  return {.name = name, .type = Type::kNumber, .doc = doc, .line = line};
}
ControlKey with_unit(Unit unit, const char* name, const char* line, const char* doc) {
  return {.name = name, .type = Type::kNumber, .doc = doc, .line = line, .unit = unit};
}
ControlKey integer(const char* name, const char* line, double min, double max, const char* doc) {
  return {.name = name, .type = Type::kInteger, .doc = doc, .line = line, .min = min, .max = max};
}
ControlKey texts(const char* name, const char* line, const char* doc) {
  return {.name = name, .type = Type::kTexts, .doc = doc, .line = line};
}
ControlKey numbers(const char* name, const char* line, const char* doc) {
  return {.name = name, .type = Type::kNumbers, .doc = doc, .line = line};
}
ControlKey flag(const char* name, const char* line, const char* doc) {
  return {.name = name, .type = Type::kBoolean, .doc = doc, .line = line};
}
ControlKey object(const char* name, const char* doc) {
  return {.name = name, .type = Type::kObject, .doc = doc};
}
/// One of some texts, which it lists.
ControlKey choice(const char* name, const char* line, std::vector<std::string> of) {
  return {.name = name, .doc = fmt::format("{}", fmt::join(of, ", ")), .line = line, .choices = of};
}
ControlKey need(ControlKey key) { return key.required = true, key; }
/// The same for the command line alone.
ControlKey local(ControlKey key) { return key.sent = false, key; }

const ControlKey kJoint = need(text("joint", "joint", "its name"));
const char kLoaded[] = "of a loaded controller";

// clang-format off
const std::vector<CommandRow> kRows{
    {"help", kReads, "lists the commands", {}, {.on_line = false}},
    {"status", kReads, "phase and counts of the run", {}, {.on_line = false}},
    {"loop.show", kReads, "robot, cycle times and buses of the run", {}, {.on_line = false}},
    {"top", kReads, "shows all of it as a table that follows: loop, faults, controllers, joints",
     {local(flag("once", "--once", "print one table and end, as without a terminal"))},
     {.asks = "loop.show"}},
    {"expect.show", kReads, "how far the run's expectations are", {}, {.on_line = false}},
    {"fault.show", kReads, "every fault of the run, latched or cleared"},
    {"fault.reset", kChanges, "clears what is latched; resets or failed_resets counts on when done",
     {}, {.by_event = true}},
    {"estop", kStops, "emergency stop, latched; waits until the loop confirms it",
     {integer("category", "--category", 0, 2, "0, 1 or 2; else what robot.toml's [safety] says"),
      local(flag("trust-domain", "--trust-domain",
                 "believe whoever answers in the DDS domain, where nobody but robots is"))},
     {.answer_s = kStop_s}},
    {"run.stop", kEnds, "ends the run in order", {}, {.on_line = false, .by_event = true}},

    {"controller.list", kReads, "every loaded controller and its claims"},
    {"controller.available", kReads, "the names by which controllers can be loaded"},
    {"controller.show", kReads, "claims and parameters of a controller",
     {text("name", "", "of a loaded controller; else of every one"),
      need(local(text("controller", "name", kLoaded)))}},
    {"controller.set", kChanges,
     "sets live parameters of a controller between two cycles, all or none",
     {text("name", "", "of a loaded controller; else the parameters are named NAME.PARAMETER"),
      need(object("parameters",
                  "by name the values: a number, true or false, a word; of a list one number for "
                  "all, or all of them, and of its elements by \"kp.joint2\"")),
      flag("each", "", "true: each by itself; `results` has what became of it"),
      need(local(text("controller", "name", kLoaded))),
      need(local(texts("values", "values",
                       "one or more of NAME=VALUE: kp=40; of a list kp=[40,40,20], kp.joint2=30")))},
     {.by_event = true}},
    {"controller.load", kChanges, "loads a controller, inactive",
     {need(text("plugin", "plugin", "its name, or the path of its library")),
      text("name", "--name", "default: the plugin's"),
      {.name = "parameters", .type = Type::kTextOrObject,
       .doc = "[controller.parameters]: TOML, or an object"},
      text("parameters_file", "--parameters",
           "the file of them, in errors: parameters; the command line reads it: TOML"),
      local(texts("set", "--set", "one parameter, 'key = value', beside the file's; repeatable")),
      flag("untried", "--untried", "open it without the trial in a process of its own: a crash ends the run"),
      local(flag("start", "--start", "start it as well"))},
     {.by_event = true, .answer_s = kLibrary_s}},
    {"controller.reload", kChanges,
     "loads a controller's library as it is now, with the same parameters, and puts it in the "
     "place of the former build in one cycle; it goes on with the former one's state where that "
     "has the same shape",
     {need(text("name", "name", kLoaded)),
      flag("fresh", "--fresh", "start from the measured state in any case"),
      flag("untried", "--untried", "open it without the trial in a process of its own: a crash ends the run")},
     {.by_event = true, .answer_s = kLibrary_s}},
    {"controller.unload", kChanges, "frees an inactive controller",
     {need(text("name", "name", kLoaded))},
     {.by_event = true}},
    {"controller.start", kChanges, "starts a controller, or all that a reset holds back",
     {text("name", "", "of a loaded controller; else those that were active before the reset"),
      local(texts("names", "names", "none: those that were active before the reset"))},
     {.by_event = true}},
    {"controller.stop", kChanges, "stops a controller; its joints are held",
     {need(text("name", "", kLoaded)), need(local(texts("names", "names", "of controllers")))},
     {.by_event = true}},
    {"controller.switch", kChanges, "stops some and starts others in one cycle, all or none",
     {texts("stop", "--stop", "controllers to stop"), texts("start", "--start", "and to start"),
      {.name = "when_within", .type = Type::kNumber, .doc = "waits until the shadows to start are "
       "so near to what is commanded [unit of the reference: rad or m in position control], in the "
       "same modes", .line = "--when-within", .unit = Unit::kPlace, .min = 0.0, .max = 1e6},
      choice("unit", "", {"angle", "length"}),
      choice("strictness", "--strictness", {"strict", "best_effort", "force"}),
      flag("cancel", "--cancel", "instead: the switch that waits is given up"),
      {.name = "timeout_s", .type = Type::kNumber, .doc = "with it: how long at most [s], of the "
       "run's time, 0 to 3600; default 10. Then nothing has changed", .line = "--timeout",
       .unit = Unit::kTime, .min = 0.0, .max = 3600.0}},
     {.by_event = true}},
    {"controller.shadow", kChanges,
     "runs an inactive controller beside the active ones on live data, without commanding",
     {need(text("name", "name", kLoaded)), flag("end", "--end", "it is no shadow any more")}},
    {"controller.difference", kReads,
     "of each shadow: its references less those that are commanded, joint by joint",
     {text("name", "name", "of a shadow; else of every one")}},

    {"joint.list", kReads, "every joint: who has it, what it does, what is measured",
     {local(texts("joints", "joints", "only these")),
      local(flag("drives", "--drives", "motor position, current, voltage and winding instead")),
      local(flag("gains", "--gains", "the gains of its drive's loops instead"))}},
    {"joint.show", kReads, "one joint: encoders on both sides, drive, its fault in words",
     {local(kJoint)}, {.asks = "joint.list"}},
    {"joint.set", kChanges,
     "mode and interaction of a joint that no active controller claims, impedance of any",
     {kJoint,
      choice("mode", "--mode",
             {"idle", "position", "velocity", "torque", "open_loop", "current"}),
      choice("interaction", "--interaction", {"stiff", "compliant"}),
      number("stiffness_Nm_rad", "--stiffness", "of the virtual spring [Nm/rad, of a slide N/m]"),
      number("damping_Nms_rad", "--damping", "of the virtual damper [Nms/rad, of a slide Ns/m]")},
     {.by_event = true}},
    {"joint.move", kChanges,
     "moves a joint that no active controller claims, with a trapezoidal velocity profile",
     {kJoint,
      need(with_unit(Unit::kPlace, "target_rad", "--to", "where to [rad, of a slide m]")),
      with_unit(Unit::kSpeed, "speed_rad_s", "--speed", "else a quarter of its limit"),
      with_unit(Unit::kAcceleration, "acceleration_rad_s2", "--acceleration",
                "else it reaches the speed in half a second"),
      choice("unit", "", {"angle", "length"}),
      flag("shortest", "--shortest",
           "the target by whole turns nearest to the joint, within its limits"),
      local(flag("wait", "--wait",
                 "until it has arrived: status 0; 1 when the motion ended elsewhere. Ctrl-C ends "
                 "the waiting, not the motion: tandem joint stop"))},
     {.by_event = true}},
    {"joint.posture", kChanges,
     "leads joints that no active controller claims to a posture of the robot, so that all arrive "
     "together",
     {need(text("posture", "posture", "of robot.toml's [posture.NAME]")),
      texts("joints", "--joints", "only these; else every joint"),
      {.name = "speed", .type = Type::kNumber,
       .doc = "share of its greatest velocity for the joint that takes longest; default 0.1",
       .line = "--speed", .min = 0.001, .max = 1.0}},
     {.by_event = true}},
    {"joint.tuning", kReads,
     "the gains and impedances in force as [gains.NAME] tables for robot.toml"},
    {"joint.stop", kChanges, "brakes a joint that `joint move`, `home` or `recover` leads", {kJoint},
     {.by_event = true}},
    {"joint.halt", kChanges, "brakes every joint that `joint move`, `home` or `recover` leads",
     {}, {.by_event = true}},
    {"joint.home", kChanges,
     "lets the drive of a joint find the joint's place, as its `homing` in robot.toml says; the "
     "command line waits for that: status 1 when it failed", {kJoint},
     {.by_event = true}},
    {"joint.recover", kChanges,
     "leads a joint that stands outside its limits back, at a twentieth of its velocity", {kJoint},
     {.by_event = true}},
    {"joint.reset", kChanges,
     "clears the fault of one drive; while the run is faulted nothing is enabled", {kJoint},
     {.by_event = true}},
    {"joint.gains", kChanges, "gains of a loop in a joint's drive, by SDO",
     {kJoint, need(choice("loop", "loop", {"position", "velocity", "torque", "current"})),
      number("kp", "--kp", "as in [gains]; it stays if left out"),
      number("ki", "--ki", "of the integral: kp's units per second"),
      number("kd", "--kd", "of the derivative: kp's units times seconds"),
      flag("anyway", "--anyway", "true: also when the model finds the loop unstable")},
     {.by_event = true}},

    {"site.move", kChanges,
     "leads a site of the robot a small step, by joints that no active controller claims",
     {need(text("site", "site", "of robot.toml's [[site]]")),
      need(choice("axis", "axis", {"x", "y", "z", "roll", "pitch", "yaw"})),
      need({.name = "by", .type = Type::kNumber, .doc = "how far [m; of an angle rad]",
            .line = "--by", .min = -0.2, .max = 0.2}),
      choice("axes", "--axes", {"base", "site"}),
      {.name = "speed", .type = Type::kNumber,
       .doc = "[m/s, rad/s]; default 0.05, of an angle 0.2; slower where a joint's limit says so",
       .line = "--speed", .min = 0.001, .max = 2.0}},
     {.by_event = true}},

    {"input.list", kReads, "every input of the loaded controllers: who feeds it, what holds",
     {local(texts("inputs", "inputs", "only these"))}},
    {"input.set", kChanges, "gives an input of a controller a sample, which counts until its time-out",
     {need(text("name", "name", "of the input, or CONTROLLER/INPUT where several have it")),
      {.name = "values", .type = Type::kObject,
       .doc = "numbers by component: the others have what holds without a sample"},
      {.name = "trajectory", .type = Type::kObject,
       .doc = "points: a list of after_s, position_rad and velocity_rad_s, a number per joint"},
      local(texts("components", "values", "x=0.2 yaw=0.1: of the components; the others have "
                  "what holds without a sample")),
      local(texts("point", "--point", "of a trajectory: after_s and each joint's position, with "
                  "commas; repeatable")),
      local({.name = "for_s", .type = Type::kNumber, .doc = "sends it again, ten times a second, "
             "for so long [s]", .line = "--for", .min = 0.0, .max = 3600.0})},
     {.of_group = true, .by_event = true}},

    {"sensor.list", kReads, "every sensor: where it is, what it measures, how old that is",
     {local(texts("sensors", "sensors", "only these"))}},
    {"signal.list", kReads, "every signal of the loaded controllers: unit, value, meaning",
     {local(texts("signals", "signals", "only these: squat.depth, or all of squat"))}},
    {"signal.watch", kReads, "prints signals again and again, a line each time",
     {local(texts("signals", "signals", "only these: squat.depth, or all of squat")),
      local({.name = "every", .type = Type::kNumber, .doc = "seconds from line to line; default 0.1",
             .line = "--every", .min = 0.001, .max = 3600}),
      local(integer("count", "--count", 1, 1e9,
                    "lines; else until Ctrl-C, or the run's end"))},
     {.asks = "signal.list"}},
    {"clock.show", kReads, "where the clock stands, and how fast it is"},
    {"clock.pause", kChanges, "simulated time stands after this cycle"},
    {"clock.resume", kChanges, "simulated time continues at its rate"},
    {"clock.step", kChanges, "while paused: so many cycles, then it stands again",
     {integer("cycles", "cycles", 1, 1e9, "1 to 1000000000; default 1"),
      with_unit(Unit::kTime, "to_s", "--to", "instead: until this time is there [s]")}},
    {"clock.rewind", kChanges, "goes back in simulated time, and stands there",
     {need(with_unit(Unit::kTime, "by_s", "by", "how far [s]"))},
     {.takes_long = true, .answer_s = kSearch_s}},
    {"clock.goto", kChanges, "goes to a time that has been, and stands there",
     {need(with_unit(Unit::kTime, "time_s", "time", "of the run [s]"))},
     {.takes_long = true, .answer_s = kSearch_s}},
    {"clock.back-until", kChanges, "goes back to where a condition became true last",
     {need(text("condition", "condition", "as 'torque(LKneeSag) > 40Nm'"))},
     {.takes_long = true, .answer_s = kSearch_s}},
    {"clock.until", kChanges, "goes on until a condition becomes true, and stands there",
     {text("condition", "condition", "as 'torque(LKneeSag) > 40Nm'; a second one replaces the first"),
      flag("cancel", "--cancel", "instead: the one that waits is given up; time goes on as it does")}},
    {"clock.rate", kChanges, "simulated seconds per wall second, from the next cycle on",
     {{.name = "rate", .type = Type::kNumber, .required = true,
       .doc = "0.01 to 1000; 0: as fast as possible", .line = "rate",
       .min = 0.01, .max = 1000, .or_zero = true}}},
    {"predict", kReads, "what the robot will do, by running its model ahead",
     {number("horizon_s", "--horizon", "[s] from one cycle to 10; default 1"),
      integer("every_cycles", "--every", 1, 1e9,
              "cycles between two rows of the answer; default: about 100 rows")},
     {.takes_long = true}},
    {"link.set", kChanges,
     "changes the declared link of [teleoperation], in simulated time; what is left out stays",
     {choice("way", "--way", {"up", "down", "both"}),
      with_unit(Unit::kTime, "delay_s", "--delay", "of what is sent from now on [s], 0 to 60"),
      with_unit(Unit::kTime, "jitter_s", "--jitter", "[s], 0 to 60"),
      {.name = "loss", .type = Type::kNumber, .doc = "share of messages that is lost, at random",
       .line = "--loss", .min = 0.0, .max = 1.0}},
     {.by_event = true}},
    {"push", kChanges, "pushes a simulated robot, from the next cycle on",
     {text("site", "site", "of robot.toml's [[site]]; else --link or --joint"),
      text("link", "--link", "of the description"), text("joint", "--joint", "whose body"),
      numbers("force_N", "--force", "x,y,z [N]; the greatest of its shape"),
      numbers("torque_Nm", "--torque", "x,y,z [Nm]"),
      numbers("impulse_Ns", "--impulse", "instead of a force: what its duration divides [Ns]"),
      numbers("impulse_Nms", "--angular-impulse", "instead of a torque [Nms]"),
      numbers("point_m", "--point", "where, in the frame of the place [m]"),
      choice("frame", "--frame", {"world", "local"}),
      choice("shape", "--shape", {"step", "half_sine", "triangle"}),
      with_unit(Unit::kTime, "for_s", "--for", "how long it lasts [s]")},
     {.by_event = true}},
    {"inject", kChanges, "inject faults, from the next cycle on",
     {need(text("scenario", "", "[[fault]] tables, TOML")),
      need(local(texts("fault", "fault", "key=value words, or TOML")))},
     {.any_process = true, .by_event = true}},
    {"studio.open", kChanges, "shows the run in a browser; the answer has the address with its token",
     {integer("port", "", 0, 65535, "else the first that is free from 8642 on; 0: any"),
      text("address", "", "where it listens; else 127.0.0.1"),
      text("page", "", "folder of the page, instead of the program's own: for work on it"),
      texts("origins", "", "whose pages may look by Foxglove's protocol: https://app.foxglove.dev")},
     {.on_line = false, .answer_s = 30}},
    {"dds.show", kReads, "the participant by which this process is on DDS", {},
     {.on_line = false, .answer_s = kStop_s}},
    {"dds.admit", kChanges, "lets a participant of the DDS domain change what [remote] allows",
     {need(text("participant", "", "its GUID's first 12 bytes in hexadecimal digits: those of "
                "`ros2 topic info -v`, dots and what follows are left out"))},
     {.on_line = false}},
};
// clang-format on

}  // namespace

const char* to_string(ControlEffect effect) {
  switch (effect) {
    case kReads: return "reads";
    case kChanges: return "changes";
    case kEnds: return "ends";
    case kStops: return "stops";
  }
  return "?";
}

const std::vector<CommandRow>& command_rows() { return kRows; }

const CommandRow* command_row(std::string_view name) {
  const auto found = std::ranges::find(command_rows(), name, &CommandRow::name);
  return found == command_rows().end() ? nullptr : &*found;
}

Status check_value(const ControlKey& key, const Json& value) {
  if (!is_of(value, key.type)) {
    return fail(fmt::format("is not of type {}", to_string(key.type)), key.doc);
  }
  if (value.is_string() && !key.choices.empty()) {
    const auto wanted = value.get<std::string>();
    if (std::ranges::find(key.choices, wanted) == key.choices.end()) {
      return fail(fmt::format("cannot be '{}'", whole_characters(wanted, kMostNamed)),
                  suggest(wanted, key.choices));
    }
  }
  if (!value.is_number()) return {};
  const auto number = value.get<double>();
  if (!std::isfinite(key.min)) {
    return std::isfinite(number) ? Status() : fail("is no finite number", key.doc);
  }
  if ((number >= key.min && number <= key.max) || (key.or_zero && number == 0.0)) return {};
  return fail(
      fmt::format("is {}from {} to {}", key.or_zero ? "neither 0 nor " : "not ", key.min, key.max),
      key.doc);
}

std::string words_of(const ControlKey& key) {
  return fmt::format("{}{}: {}", to_string(key.type), key.required ? "" : ", optional", key.doc);
}

}  // namespace tandem::apps
