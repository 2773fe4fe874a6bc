#include "apps/control/command_rows.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "base/nearest.hpp"

namespace tandem::apps {
namespace {

using Type = ControlKey::Type;
using Unit = ControlKey::Unit;
using enum ControlEffect;

const char* to_string(Type type) {
  switch (type) {
    case Type::kText: return "text";
    case Type::kInteger: return "integer";
    case Type::kNumber: return "number";
    case Type::kBoolean: return "true or false";
    case Type::kObject: return "object";
    case Type::kTexts: return "list of texts";
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
    case Type::kTextOrObject: return value.is_string() || value.is_object();
  }
  return false;
}

const ControlKey kJoint{.name = "joint", .required = true, .doc = "its name", .line = "joint"};
const ControlKey kController{
    .name = "name", .required = true, .doc = "of a loaded controller", .line = "name"};

/// A gain of a drive's loop.
ControlKey gain(const char* name, const char* doc) {
  return {.name = name, .type = Type::kNumber, .doc = doc, .line = std::string("--") + name};
}

/// Names that only the command line takes, as many as there are.
ControlKey names(const char* name, const char* doc, bool required = false) {
  return {.name = name,
          .type = Type::kTexts,
          .required = required,
          .doc = doc,
          .line = name,
          .sent = false};
}

/// A flag of the command line alone.
ControlKey flag(const char* name, const char* doc) {
  return {.name = name,
          .type = Type::kBoolean,
          .doc = doc,
          .line = std::string("--") + name,
          .sent = false};
}

// clang-format off: a table
const std::vector<CommandRow>& rows_of_runs() {
  static const std::vector<CommandRow> rows{
      {.name = "help", .doc = "lists the commands", .on_line = false},
      {.name = "status", .doc = "phase and counts of the run", .on_line = false},
      {.name = "fault.show", .doc = "every fault of the run, latched or cleared"},
      {.name = "fault.reset",
       .effect = kChanges,
       .doc = "clears what is latched; resets or failed_resets counts on when done"},
      {.name = "estop",
       .effect = kStops,
       .doc = "emergency stop, latched; waits until the loop confirms it",
       .keys = {{.name = "category",
                 .type = Type::kInteger,
                 .doc = "0, 1 or 2; else what robot.toml's [safety] says",
                 .line = "--category",
                 .min = 0,
                 .max = 2},
                flag("trust-domain",
                     "believe whoever answers in the DDS domain, where nobody but robots is")}},
      {.name = "run.stop", .effect = kEnds, .doc = "ends the run in order", .on_line = false},
      {.name = "sensor.list",
       .doc = "every sensor: where it is, what it measures, how old that is",
       .keys = {names("sensors", "only these")}},
      {.name = "clock.show", .doc = "where the clock stands, and how fast it is"},
      {.name = "clock.pause",
       .effect = kChanges,
       .doc = "simulated time stands after the cycle at work"},
      {.name = "clock.resume", .effect = kChanges, .doc = "simulated time continues at its rate"},
      {.name = "clock.step",
       .effect = kChanges,
       .doc = "while paused: so many cycles, then it stands again",
       .keys = {{.name = "cycles",
                 .type = Type::kInteger,
                 .doc = "1 to 1000000000; default 1",
                 .line = "cycles",
                 .min = 1,
                 .max = 1e9}}},
      {.name = "clock.rate",
       .effect = kChanges,
       .doc = "simulated seconds per wall second, from the next cycle on",
       .keys = {{.name = "rate",
                 .type = Type::kNumber,
                 .required = true,
                 .doc = "0.01 to 1000; 0: as fast as possible",
                 .line = "rate",
                 .min = 0.01,
                 .max = 1000,
                 .or_zero = true}}},
      {.name = "predict",
       .doc = "what the robot will do, by running its model ahead",
       .keys = {{.name = "horizon_s",
                 .type = Type::kNumber,
                 .doc = "[s] from one cycle to 10; default 1",
                 .line = "--horizon"},
                {.name = "every_cycles",
                 .type = Type::kInteger,
                 .doc = "cycles between two rows of the answer; default: about 100 rows",
                 .line = "--every",
                 .min = 1,
                 .max = 1e9}},
       .takes_long = true},
      {.name = "inject",
       .effect = kChanges,
       .doc = "inject faults, from the next cycle on",
       .keys = {{.name = "scenario", .required = true, .doc = "[[fault]] tables, TOML"},
                names("fault", "key=value words, or TOML", true)},
       .any_process = true},
      {.name = "dds.show",
       .doc = "the participant by which this process is on DDS",
       .on_line = false},
      {.name = "dds.admit",
       .effect = kChanges,
       .doc = "lets a participant of the DDS domain change what [remote] command allows",
       .keys = {{.name = "participant",
                 .required = true,
                 .doc = "its GUID's first 12 bytes in hexadecimal digits: those of `ros2 topic "
                        "info -v`, dots and what follows are left out"}},
       .on_line = false},
  };
  return rows;
}

const std::vector<CommandRow>& rows_of_controllers() {
  static const std::vector<CommandRow> rows{
      {.name = "controller.list", .doc = "every loaded controller and its claims"},
      {.name = "controller.load",
       .effect = kChanges,
       .doc = "loads a controller, inactive",
       .keys = {{.name = "plugin",
                 .required = true,
                 .doc = "its name, or the path of its library",
                 .line = "plugin"},
                {.name = "name", .doc = "default: the plugin's", .line = "--name"},
                {.name = "parameters",
                 .type = Type::kTextOrObject,
                 .doc = "[controller.parameters]: TOML, or an object"},
                {.name = "parameters_file",
                 .doc = "what errors call them: parameters; on the "
                        "command line the TOML file that has them",
                 .line = "--parameters"},
                {.name = "set",
                 .type = Type::kTexts,
                 .doc = "one parameter, 'key = value', beside the file's; may be repeated",
                 .line = "--set",
                 .sent = false},
                flag("start", "start it as well")}},
      {.name = "controller.unload",
       .effect = kChanges,
       .doc = "frees an inactive controller",
       .keys = {kController}},
      {.name = "controller.start",
       .effect = kChanges,
       .doc = "starts a controller, or all that a reset holds back",
       .keys = {{.name = "name",
                 .doc = "of a loaded controller; else those that were active "
                        "before the reset"},
                names("names",
                      "of loaded controllers; none: those that were active before the "
                      "reset")}},
      {.name = "controller.stop",
       .effect = kChanges,
       .doc = "stops a controller; its joints are held",
       .keys = {{.name = "name", .required = true, .doc = "of a loaded controller"},
                names("names", "of loaded controllers", true)}},
      {.name = "controller.switch",
       .effect = kChanges,
       .doc = "stops some and starts others in one cycle, all or none",
       .keys =
           {{.name = "stop", .type = Type::kTexts, .doc = "controllers to stop", .line = "--stop"},
            {.name = "start", .type = Type::kTexts, .doc = "and to start", .line = "--start"}}},
  };
  return rows;
}

const std::vector<CommandRow>& rows_of_joints() {
  static const std::vector<CommandRow> rows{
      {.name = "joint.list",
       .doc = "every joint: who has it, what it does, what is measured",
       .keys = {names("joints", "only these"),
                flag("drives", "motor position, current, voltage and winding instead"),
                flag("gains", "the gains of its drive's loops instead")}},
      {.name = "joint.show",
       .doc = "one joint: encoders on both sides, drive, its fault in words",
       .keys =
           {{.name = "joint", .required = true, .doc = "its name", .line = "joint", .sent = false}},
       .asks = "joint.list"},
      {.name = "joint.set",
       .effect = kChanges,
       .doc = "mode and interaction of a joint that no active controller claims, impedance of any",
       .keys = {kJoint,
                {.name = "mode",
                 .doc = "idle, position, velocity, torque, open_loop, current",
                 .line = "--mode",
                 .choices = {"idle", "position", "velocity", "torque", "open_loop", "current"}},
                {.name = "interaction",
                 .doc = "stiff, compliant",
                 .line = "--interaction",
                 .choices = {"stiff", "compliant"}},
                {.name = "stiffness_Nm_rad",
                 .type = Type::kNumber,
                 .doc = "of the virtual spring [Nm/rad, of a slide N/m]",
                 .line = "--stiffness"},
                {.name = "damping_Nms_rad",
                 .type = Type::kNumber,
                 .doc = "of the virtual damper [Nms/rad, of a slide Ns/m]",
                 .line = "--damping"}}},
      {.name = "joint.move",
       .effect = kChanges,
       .doc = "moves a joint that no active controller claims, with a trapezoidal velocity profile",
       .keys = {kJoint,
                {.name = "target_rad",
                 .type = Type::kNumber,
                 .required = true,
                 .doc = "where to [rad, of a slide m]",
                 .line = "--to",
                 .unit = Unit::kPlace},
                {.name = "speed_rad_s",
                 .type = Type::kNumber,
                 .doc = "else a quarter of its limit",
                 .line = "--speed",
                 .unit = Unit::kSpeed},
                {.name = "acceleration_rad_s2",
                 .type = Type::kNumber,
                 .doc = "else it reaches the speed in half a second",
                 .line = "--acceleration",
                 .unit = Unit::kAcceleration},
                {.name = "unit",
                 .doc = "angle, length: what the joint has to be",
                 .choices = {"angle", "length"}},
                {.name = "shortest",
                 .type = Type::kBoolean,
                 .doc = "the target by whole turns nearest to the joint, within its limits",
                 .line = "--shortest"},
                flag("wait",
                     "until it has arrived: status 0; 1 when the motion ended elsewhere. "
                     "Ctrl-C ends the waiting, not the motion: tandem joint stop")}},
      {.name = "joint.stop",
       .effect = kChanges,
       .doc = "brakes a joint that joint.move or joint.home leads",
       .keys = {kJoint}},
      {.name = "joint.home",
       .effect = kChanges,
       .doc = "lets the drive of a joint find the joint's place, as its `homing` in robot.toml "
              "says; the command line waits for that: status 1 when it failed",
       .keys = {kJoint}},
      {.name = "joint.recover",
       .effect = kChanges,
       .doc = "leads a joint that stands outside its limits back, at a twentieth of its velocity",
       .keys = {kJoint}},
      {.name = "joint.reset",
       .effect = kChanges,
       .doc = "clears the fault of one drive; while the run is faulted nothing is enabled",
       .keys = {kJoint}},
      {.name = "joint.gains",
       .effect = kChanges,
       .doc = "gains of a loop in a joint's drive, by SDO",
       .keys = {kJoint,
                {.name = "loop",
                 .required = true,
                 .doc = "position, velocity, torque, current",
                 .line = "loop",
                 .choices = {"position", "velocity", "torque", "current"}},
                gain("kp", "as in [gains]; it stays if left out"),
                gain("ki", "of the integral: kp's units per second"),
                gain("kd", "of the derivative: kp's units times seconds"),
                {.name = "anyway",
                 .type = Type::kBoolean,
                 .doc = "true: also when the model finds the loop unstable",
                 .line = "--anyway"}}},
  };
  return rows;
}
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

const std::vector<CommandRow>& command_rows() {
  static const std::vector<CommandRow> rows = [] {
    std::vector<CommandRow> all = rows_of_runs();
    for (const auto* more : {&rows_of_controllers(), &rows_of_joints()}) {
      all.insert(all.end(), more->begin(), more->end());
    }
    return all;
  }();
  return rows;
}

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
      return fail(fmt::format("cannot be '{}'", wanted.substr(0, kMostNamed)),
                  suggest(wanted, key.choices));
    }
  }
  if (!value.is_number()) return {};
  const auto number = value.get<double>();
  if (!std::isfinite(key.min)) {
    return std::isfinite(number) ? Status() : fail("is no finite number", key.doc);
  }
  if ((number >= key.min && number <= key.max) || (key.or_zero && number == 0.0)) return {};
  return fail(fmt::format("is {}from {} to {}", key.or_zero ? "neither 0 nor " : "not ", key.min,
                          key.max),
              key.doc);
}

std::string words_of(const ControlKey& key) {
  return fmt::format("{}{}: {}", to_string(key.type), key.required ? "" : ", optional", key.doc);
}

}  // namespace tandem::apps
