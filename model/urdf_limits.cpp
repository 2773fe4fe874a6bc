#include "model/urdf_limits.hpp"

#include <algorithm>
#include <cmath>

#include "base/bounds.hpp"
#include "base/counted.hpp"
#include "model/urdf_numbers.hpp"

namespace tandem::model {
namespace {

using tinyxml2::XMLElement;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kMostWay_rad = 26.0;  // of a revolute joint: more is degrees, most likely
constexpr double kNoWay_rad = 6283.0;  // 1000 turns: no limit
constexpr double kNoWay_m = 1000.0;
constexpr double kNoSize = 1e15;  // of an effort, a speed, an acceleration, a jerk

bool is_range(double lower, double upper) { return lower < upper; }

}  // namespace

void LimitsReader::Said::add(const std::string& joint, int at, std::string_view what) {
  if (joints.empty()) {
    example = what;
    line = at;
  }
  joints.push_back(joint);
}

void LimitsReader::read(const XMLElement& element, OutlineJoint& joint, const std::string& key,
                        Diagnostics& warnings) {
  if (const XMLElement* limit = element.FirstChildElement("limit")) {
    read_limit(*limit, joint, key, warnings);
  } else if (joint.type == "continuous") {
    joint.velocity = joint.effort = kInfinity;
  } else {
    joint.limits_note =
        "the joint at " + file_ + ":" + std::to_string(joint.line) + " has no <limit>";
  }
  if (joint.type == "continuous") {
    joint.lower = -kInfinity;
    joint.upper = kInfinity;
  }
  if (const XMLElement* safety = element.FirstChildElement("safety_controller"))
    read_safety(*safety, joint, key, warnings);
  if (const XMLElement* dynamics = element.FirstChildElement("dynamics"))
    read_dynamics(*dynamics, joint);
}

/// The number of an attribute, infinity and NaN among them; `none` where it is not there.
double LimitsReader::number(const XMLElement& e, const char* name, double none,
                            const std::string& key) {
  const char* const text = e.Attribute(name);
  if (text == nullptr) return none;
  const std::string where = std::string("'") + name + "' of <" + e.Name() + ">";
  const std::vector<std::string> words = words_of(text);
  if (words.size() != 1) {
    add_error(errors_, {where + " has " + counted(words.size(), "number"), "give 1", file_,
                        e.GetLineNum(), key});
    return none;
  }
  const NumberText found = number_of(words[0]);
  if (found.kind != NumberKind::kNoNumber) return found.value;
  add_error(errors_, {where + " is no number: '" + words[0] + "'", "write it as 1.5e-3", file_,
                      e.GetLineNum(), key});
  return none;
}

void LimitsReader::note(OutlineJoint& joint, int line, const std::string& what) const {
  joint.limits_note += joint.limits_note.empty() ? file_ + ":" + std::to_string(line) + ": " : ", ";
  joint.limits_note += what;
}

/// A velocity or an effort.
double LimitsReader::most(const XMLElement& e, const char* name, OutlineJoint& joint,
                          const std::string& key) {
  const double value = number(e, name, kNoLimit, key);
  if (value > 0.0 && value < kNoSize) return value;
  const bool missing = e.Attribute(name) == nullptr;
  note(joint, e.GetLineNum(),
       name + std::string(missing                                 ? " is missing"
                          : value >= kNoSize || std::isnan(value) ? " is no limit"
                                                                  : " is not above 0"));
  return kNoLimit;
}

void LimitsReader::read_limit(const XMLElement& limit, OutlineJoint& joint, const std::string& key,
                              Diagnostics& warnings) {
  joint.lower = number(limit, "lower", 0.0, key);
  joint.upper = number(limit, "upper", 0.0, key);
  if (joint.type != "continuous") read_range(limit, joint, key, warnings);
  joint.velocity = most(limit, "velocity", joint, key);
  joint.effort = most(limit, "effort", joint, key);
  joint.extras.no_effort = limit.DoubleAttribute("effort", kNoLimit) == 0.0;
  const auto above_zero = [&](const char* name) {
    const double value = number(limit, name, kNoLimit, key);
    return value > 0.0 && value < kNoSize ? value : kNoLimit;
  };
  // One key of robot.toml is for both ways.
  joint.extras.acceleration = std::fmin(above_zero("acceleration"), above_zero("deceleration"));
  joint.extras.jerk = above_zero("jerk");
}

void LimitsReader::read_range(const XMLElement& limit, OutlineJoint& joint, const std::string& key,
                              Diagnostics& warnings) {
  const double no_way = joint.type == "prismatic" ? kNoWay_m : kNoWay_rad;
  for (double* side : {&joint.lower, &joint.upper})
    if (!(std::abs(*side) < no_way)) *side = kNoLimit;
  if (std::isnan(joint.lower) || std::isnan(joint.upper)) return read_endless(limit, joint);
  if (joint.type == "revolute" &&
      std::max(std::abs(joint.lower), std::abs(joint.upper)) > kMostWay_rad) {
    add_error(warnings, {"the joint's limits are more than four turns away",
                         "angles are in radians", file_, limit.GetLineNum(), key});
  }
  if (is_range(joint.lower, joint.upper)) return;
  const bool missing = limit.Attribute("lower") == nullptr && limit.Attribute("upper") == nullptr;
  note(joint, limit.GetLineNum(),
       missing                     ? "lower and upper are missing"
       : joint.lower > joint.upper ? "lower is above upper"
                                   : "lower and upper are equal");
  joint.lower = joint.upper = kNoLimit;
}

/// What has no end on both sides turns as a continuous joint does; a single side, and both of what
/// slides, are left to robot.toml.
void LimitsReader::read_endless(const XMLElement& limit, OutlineJoint& joint) {
  const auto text = [&limit](const char* name) {
    const char* const given = limit.Attribute(name);
    return std::string(given == nullptr ? "0" : given);
  };
  const bool both = std::isnan(joint.lower) && std::isnan(joint.upper);
  if (!both || joint.type != "revolute") {
    const std::string sides = both                      ? "lower and upper are"
                              : std::isnan(joint.lower) ? "lower is"
                                                        : "upper is";
    return note(joint, limit.GetLineNum(), sides + " no limit");
  }
  turning_.add(joint.name, limit.GetLineNum(), text("lower") + " to " + text("upper"));
  joint.type = "continuous";
}

void LimitsReader::read_safety(const XMLElement& safety, OutlineJoint& joint,
                               const std::string& key, Diagnostics& warnings) {
  joint.extras.soft_lower = number(safety, "soft_lower_limit", kNoLimit, key);
  joint.extras.soft_upper = number(safety, "soft_upper_limit", kNoLimit, key);
  const bool none = joint.type == "continuous" ||
                    (std::isnan(joint.extras.soft_lower) && std::isnan(joint.extras.soft_upper)) ||
                    (joint.extras.soft_lower == 0.0 && joint.extras.soft_upper == 0.0);
  // fmax() and fmin() take the other one where one is not there.
  const double lower = std::fmax(joint.extras.soft_lower, joint.lower);
  const double upper = std::fmin(joint.extras.soft_upper, joint.upper);
  if (!none && !(lower >= upper)) return;
  if (!none) {
    add_error(warnings, {"the soft limits of <safety_controller> leave the joint no way",
                         "they are not used: correct them", file_, safety.GetLineNum(), key});
  }
  joint.extras.soft_lower = joint.extras.soft_upper = kNoLimit;
}

/// Not the dynamics of a run unless somebody asks for it, so what is unreadable is nothing.
void LimitsReader::read_dynamics(const XMLElement& dynamics, OutlineJoint& joint) {
  const auto size = [&dynamics](const char* name) {
    const double value = dynamics.DoubleAttribute(name);
    return std::abs(value) < kNoSize ? value : 0.0;
  };
  joint.extras.damping = size("damping");
  joint.extras.friction = size("friction");
  if (joint.extras.damping == 0.0 && joint.extras.friction == 0.0) return;
  damped_.add(joint.name, dynamics.GetLineNum(), {});
}

void LimitsReader::warn(Diagnostics& warnings) const {
  if (!turning_.joints.empty()) {
    const std::size_t more = turning_.joints.size() - 1;
    add_error(warnings, {"the limits of " + counted(turning_.joints.size(), "revolute joint") +
                             " are none (" + turning_.joints[0] + ": " + turning_.example +
                             (more == 0 ? ")" : "; and " + std::to_string(more) + " more)") +
                             ": read as continuous",
                         "give real limits where there are some", file_, turning_.line,
                         "joint " + turning_.joints[0]});
  }
  if (damped_.joints.empty()) return;
  warnings.push_back({"the damping and friction of " + counted(damped_.joints.size(), "joint") +
                          " (<dynamics>) is not used: a joint's are its actuator's",
                      "damping_Nms_rad and friction_Nm of [actuator.NAME] in robot.toml", file_,
                      damped_.line, "dynamics"});
}

}  // namespace tandem::model
