// What `tandem joint` prints of joints: tables, one joint with its drive, values with their units.
#include "apps/clients/joint_print.hpp"

#include <fmt/core.h>

#include <cstdio>
#include <numbers>

#include "base/counted.hpp"

namespace tandem::apps {
namespace {

constexpr double kDegPerRadian = 180.0 / std::numbers::pi;

}  // namespace

std::string number_of(const Json& joint, const char* key) {
  return joint[key].is_number() ? fmt::format("{:.4g}", joint[key].get<double>()) : "-";
}

std::string mode_of(const Json& joint) {
  const std::string mode = joint.value("mode", "");
  const std::string in_force = joint.value("mode_in_force", "");
  const std::string yields = joint.value("interaction", "") == "compliant" ? ", compliant" : "";
  return mode + yields + (in_force == mode ? "" : " (" + in_force + ")");
}

bool slides(const Json& joint) { return joint.value("slides", false); }
std::string unit_of(const Json& joint) { return slides(joint) ? "m" : "rad"; }
std::string torque_unit_of(const Json& joint) { return slides(joint) ? "N" : "Nm"; }

std::string place_of(const Json& joint, const Json& value, bool degrees) {
  if (!value.is_number()) return "-";
  const double number = value.get<double>();
  const std::string place = fmt::format("{:.4g} {}", number, unit_of(joint));
  return degrees ? fmt::format("{} ({:.4g} deg)", place, number * kDegPerRadian) : place;
}

namespace {

/// Its state and fault; of a drive that is not heard, whose figures are old, that alone.
std::string drive_of(const Json& joint) {
  const std::string feedback = joint.value("feedback", "");
  if (feedback == "lost") {
    return fmt::format("no feedback for {} cycles", joint.value("age_cycles", 0U));
  }
  const auto fault = joint.value("fault", 0U);
  const std::string state = joint.value("drive_state", "");
  const char* sensor = feedback == "sensor_fault" ? ", sensor" : "";
  if (fault != 0) return fmt::format("{} (0x{:04X}){}", state, fault, sensor);
  const std::string homing = joint.value("homing", "");
  return homing == "not homed"   ? state + ", not homed"
         : homing == "under way" ? state + ", is being homed"
                                 : state;
}

/// What the figures of a joint are worth.
std::string sample_of(const Json& joint) {
  const std::string feedback = joint.value("feedback", "");
  if (feedback == "sensor_fault") return "a sensor is in fault: what it measures is not valid";
  const auto age_cycles = joint.value("age_cycles", 0U);
  if (age_cycles == 0) return "fresh";
  return fmt::format("{} old{}", counted(age_cycles, "cycle"),
                     feedback == "lost" ? ": no feedback" : "");
}

/// Columns whose unit depends on the joint. It stands in the heading where all joints share it,
/// else behind each value.
class Units {
 public:
  explicit Units(const Json& joints) {
    if (!joints.empty()) first_ = joints.front();
    for (const Json& joint : joints) mixed_ = mixed_ || slides(joint) != slides(first_);
  }
  /// @param of  unit_of or torque_unit_of; `per` is added to what it says
  template <class UnitOf>
  [[nodiscard]] std::string heading(const char* name, const UnitOf& of,
                                    const char* per = "") const {
    return mixed_ ? name : fmt::format("{} [{}{}]", name, of(first_), per);
  }
  template <class UnitOf>
  [[nodiscard]] std::string value(const Json& joint, const char* key, const UnitOf& of,
                                  const char* per = "") const {
    return number_of(joint, key) + (mixed_ ? " " + of(joint) + per : "");
  }

 private:
  Json first_ = Json::object();
  bool mixed_ = false;
};

std::string limits_of(const Json& joint) {
  const Json &min = joint["min_position_rad"], &max = joint["max_position_rad"];
  std::string range = "any position";
  if (min.is_number() && max.is_number()) {
    range =
        fmt::format("{:.4g} to {:.4g} {}", min.get<double>(), max.get<double>(), unit_of(joint));
    if (!slides(joint)) {
      range += fmt::format(" ({:.4g} to {:.4g} deg)", min.get<double>() * kDegPerRadian,
                           max.get<double>() * kDegPerRadian);
    }
  }
  return fmt::format("{}, {} {}/s, {} {}", range, number_of(joint, "max_velocity_rad_s"),
                     unit_of(joint), number_of(joint, "max_torque_Nm"), torque_unit_of(joint));
}

/// What not every drive tells.
std::string told(const Json& joint, const char* key, const char* unit = "") {
  return joint[key].is_number() ? number_of(joint, key) + unit : "not known";
}

}  // namespace

void print_joints(const Json& joints) {
  const Units units(joints);
  Table table({"joint", "controller", "mode", units.heading("position", unit_of),
               units.heading("velocity", unit_of, "/s"), units.heading("torque", torque_unit_of),
               "drive"});
  for (const Json& joint : joints) {
    const std::string owner = joint.value("controller", "");
    table.add({joint.value("joint", ""), owner.empty() ? "-" : owner, mode_of(joint),
               units.value(joint, "position_rad", unit_of),
               units.value(joint, "velocity_rad_s", unit_of, "/s"),
               units.value(joint, "torque_Nm", torque_unit_of), drive_of(joint)});
  }
  table.print(stdout);
}

void print_drives(const Json& joints) {
  const Units units(joints);
  Table table({"joint", units.heading("motor", unit_of), "current [A]", "voltage [V]",
               "winding [degC]", "drive"});
  for (const Json& joint : joints) {
    table.add({joint.value("joint", ""), units.value(joint, "motor_position_rad", unit_of),
               told(joint, "current_A"), told(joint, "voltage_V"), told(joint, "temperature_C"),
               drive_of(joint)});
  }
  table.print(stdout);
}

void print_gains(const Json& joints) {
  Table table({"joint", "loop", "kp", "ki", "kd"});
  for (const Json& joint : joints) {
    for (const auto& [loop, gains] : joint["gains"].items()) {
      table.add({joint.value("joint", ""), loop, number_of(gains, "kp"), number_of(gains, "ki"),
                 number_of(gains, "kd")});
    }
  }
  table.print(stdout);
}

void print_joint(const Json& joint) {
  const std::string unit = unit_of(joint);
  const std::string torque = torque_unit_of(joint);
  const auto with = [&](const char* key, const std::string& of) {
    return number_of(joint, key) + " " + of;
  };
  const std::string owner = joint.value("controller", ""), fault = joint.value("fault_text", "");
  Facts facts;
  facts.add("joint", joint.value("joint", "") + (unit == "m" ? ", slides" : ", turns"));
  facts.add("controller", owner.empty() ? "-" : owner);
  facts.add("mode", mode_of(joint));
  facts.add("position", with("position_rad", unit) + ", commanded " +
                            with("commanded_position_rad", unit) +
                            (joint.value("moving", false) ? ", moving" : ""));
  if (const std::string homing = joint.value("homing", "none"); homing != "none") {
    const std::string why = joint.value("homing_error", "");
    facts.add("homing", homing + (why.empty() ? "" : ": " + why));
  }
  facts.add("limits", limits_of(joint));
  facts.add("velocity", with("velocity_rad_s", unit + "/s"));
  facts.add("torque", with("torque_Nm", torque));
  facts.add("motor position", with("motor_position_rad", unit) + " at the joint");
  facts.add("motor velocity", with("motor_velocity_rad_s", unit + "/s") + " at the joint");
  facts.add("stiffness", with("stiffness_Nm_rad", torque + "/" + unit));
  facts.add("damping", with("damping_Nms_rad", torque + "s/" + unit));
  facts.add("drive", drive_of(joint));
  facts.add("fault", fault.empty() ? "none" : fault);
  facts.add("current", told(joint, "current_A", " A"));
  facts.add("voltage", told(joint, "voltage_V", " V"));
  facts.add("winding", told(joint, "temperature_C", " degC"));
  facts.add("sample", sample_of(joint));
  facts.print(stdout);
}

}  // namespace tandem::apps
