// robot.toml of a new robot.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/counted.hpp"
#include "scaffold/new_robot.hpp"
#include "scaffold/toml_words.hpp"

namespace tandem::scaffold {
namespace {

std::string number(double value) { return fmt::format("{:.6g}", value); }

std::string loop(const char* name, const hal::PidGains& g) {
  std::string text = fmt::format("{} = {{ kp = {}", name, number(g.kp));
  if (g.ki > 0.0) text += ", ki = " + number(g.ki);
  if (g.kd > 0.0) text += ", kd = " + number(g.kd);
  return text + " }" + "  # guess";
}

/// A table's lines, `key = value` each.
using Keys = std::vector<std::string>;

/// Every figure of motors and gains is made up, so every line says it.
constexpr const char* kGuess = "  # guess";
constexpr const char* kFromShapes = "  # from the collision shapes";

void add(Keys& keys, const char* key, double value) {
  keys.push_back(fmt::format("{} = {}{}", key, number(value), kGuess));
}

class Writer {
 public:
  Writer(const NewRobot& robot, const std::string& urdf, const std::string& source)
      : robot_(robot), urdf_(urdf), source_(source) {}

  std::string run() {
    head();
    model();
    sites();
    drives();
    line(
        "\n# --- wires, all of them a guess: a bus a limb, CAN FD at 1 and 8 Mbit/s, two joints a "
        "board");
    line(
        "[board_defaults]\nslow_pdo_every = {}  # guess: motor currents and the like, every n-th "
        "cycle",
        robot_.config.boards[0].slow_pdo_every);
    for (const hal::BusConfig& bus : robot_.config.buses) wire(bus);
    joints();
    sensors();
    if (!robot_.feet.empty()) contact();
    posture();
    return std::move(text_);
  }

 private:
  template <class... Args>
  void line(fmt::format_string<Args...> format, Args&&... args) {
    fmt::format_to(std::back_inserter(text_), format, std::forward<Args>(args)...);
    text_ += '\n';
  }

  void head() {
    line("# {}: {}, {} base, {:.2f} kg.", robot_.config.name,
         counted(robot_.config.joints.size(), "joint"),
         robot_.config.model.floating_base ? "floating" : "fixed", robot_.mass_kg);
    line("# Written by `tandem new` from {}. The description keeps its own licence: put its",
         commented(source_));
    line("# notice beside this file before you pass the folder on.");
    for (const std::string& remark : robot_.remarks) line("# {}", commented(remark));
    line("# Every key: docs/configuration.md. The rules behind the figures: docs/robots.md.");
    line("name = {}", quoted_text(robot_.config.name));
  }

  void model() {
    line("\n[model]\nurdf = {}\nbase = \"{}\"", quoted_text(urdf_),
         robot_.config.model.floating_base ? "floating" : "fixed");
    if (robot_.config.model.repair_inertia) line("inertia = \"repair\"");
    right_angles();
    if (robot_.config.model.lock.empty()) return;
    line("\n[model.lock]  # joints that stand still, in rad or m");
    for (const auto& [joint, position] : robot_.config.model.lock)
      line("{} = {}", key_of(joint), number(position));
  }

  void right_angles() {
    if (!(robot_.turned.distance_m > 0.0)) return;  // those of inertias alone cost nothing
    line(
        "# {} right angles have few digits, {:.1g} rad off at most. Exact ones move no link by "
        "more",
        robot_.right_angles.count, robot_.right_angles.worst_rad);
    line("# than {:.2g} mm, and make the dynamics smaller:\n# right_angles = \"exact\"",
         1e3 * robot_.turned.distance_m);
  }

  void sites() {
    for (std::size_t i = 0; i < robot_.feet.size(); ++i) {
      const hal::SiteConfig& site = robot_.config.model.sites[i];
      text_ += '\n';
      if (!robot_.feet[i].guess.empty()) line("# guess: {}", robot_.feet[i].guess);
      line("[[site]]\nname = {}\nlink = {}", quoted_text(site.name), quoted_text(site.link));
      const char* from = robot_.feet[i].guess.empty() ? kFromShapes : kGuess;
      const auto set = [](const auto& v) {
        return std::ranges::any_of(v, [](double x) { return x != 0.0; });
      };
      if (set(site.xyz_m)) line("xyz_m = [{:.6g}]{}", fmt::join(site.xyz_m, ", "), from);
      if (set(site.rpy_rad)) line("rpy_rad = [{:.9g}]{}", fmt::join(site.rpy_rad, ", "), from);
      line("wrench = true");
    }
  }

  /// What all tables of a kind say stands once, above them.
  void drives() {
    std::vector<Keys> actuators, sets;
    for (const DriveSize& drive : robot_.drives) actuators.push_back(keys(drive.actuator));
    for (const GainSet& set : robot_.gains) sets.push_back(keys(set.gains));
    defaults("actuator_defaults", actuators);
    for (std::size_t i = 0; i < actuators.size(); ++i) {
      line("\n# guess: a {} drive for {}; put your motor's data sheet here",
           robot_.drives[i].actuator.order < 2 ? "rigid" : "series elastic",
           robot_.drives[i].remark);
      table("actuator." + robot_.drives[i].actuator.name, actuators[i]);
    }
    defaults("gains_defaults", sets);
    for (std::size_t i = 0; i < sets.size(); ++i) {
      line("\n# {}", robot_.gains[i].remark);
      table("gains." + robot_.gains[i].gains.name, sets[i]);
    }
  }

  /// Moves the lines that all tables share into one of their own; a single table keeps them.
  void defaults(const char* name, std::vector<Keys>& tables) {
    if (tables.size() < 2) return;
    Keys common = tables[0];
    for (const Keys& other : tables) {
      std::erase_if(common, [&](const std::string& key) {
        return std::ranges::find(other, key) == other.end();
      });
    }
    if (common.empty()) return;
    for (Keys& own : tables) {
      std::erase_if(own, [&](const std::string& key) {
        return std::ranges::find(common, key) != common.end();
      });
    }
    text_ += '\n';
    table(name, common);
  }

  void table(const std::string& name, const Keys& keys) {
    line("[{}]", name);
    for (const std::string& key : keys) line("{}", key);
  }

  [[nodiscard]] Keys keys(const hal::ActuatorConfig& a) const {
    Keys keys{fmt::format("order = {}{}", a.order, kGuess)};
    add(keys, "resistance_ohm", a.resistance_ohm);
    add(keys, "inductance_H", a.inductance_H);
    add(keys, "torque_constant_Nm_A", a.torque_constant_Nm_A);
    add(keys, "gear_ratio", a.gear_ratio);
    add(keys, "inertia_kg_m2", a.inertia_kg_m2);
    add(keys, "damping_Nms_rad", a.damping_Nms_rad);
    keys.back() += "; back-EMF included";
    if (a.friction_Nm > 0.0) {
      keys.push_back(fmt::format("friction_Nm = {}{}", number(a.friction_Nm),
                                 robot_.like.empty() ? "  # the description's" : kGuess));
    }
    if (a.order >= 2) {
      add(keys, "spring_Nm_rad", a.spring_Nm_rad);
      add(keys, "spring_damping_Nms_rad", a.spring_damping_Nms_rad);
    }
    add(keys, "current_limit_A", a.current_limit_A);
    add(keys, "voltage_limit_V", a.voltage_limit_V);
    add(keys, "thermal_resistance_K_W", a.thermal_resistance_K_W);
    if (a.continuous_current_A > 0.0) {
      add(keys, "continuous_current_A", a.continuous_current_A);
      add(keys, "thermal_time_s", a.thermal_time_s);
    }
    return keys;
  }

  static Keys keys(const hal::GainsConfig& g) {
    Keys keys;
    if (g.position_feedback == hal::PositionFeedback::kMotor) {
      keys.emplace_back("position_feedback = \"motor\"");
    }
    keys.push_back(loop("position", g.position.gains));
    keys.push_back(loop("velocity", g.velocity.gains));
    if (g.torque.gains.kp > 0.0) keys.push_back(loop("torque", g.torque.gains));
    keys.push_back(loop("current", g.current.gains));
    add(keys, "emf_compensation", g.emf_compensation);
    add(keys, "stiffness_Nm_rad", g.stiffness_Nm_rad);
    add(keys, "damping_Nms_rad", g.damping_Nms_rad);
    return keys;
  }

  void wire(const hal::BusConfig& bus) {
    line("\n[[bus]]\nname = {}\ninterface = {}{}\nboards = [", quoted_text(bus.name),
         quoted_text(bus.interface), kGuess);
    for (const hal::BoardConfig& board : robot_.config.boards) {
      if (board.bus != bus.name) continue;
      std::vector<std::string> joints;
      for (const hal::JointConfig& joint : robot_.config.joints) {
        if (joint.board == board.name) joints.push_back(quoted_text(joint.name));
      }
      line("  {{ name = {}, joints = [{}] }},", quoted_text(board.name), fmt::join(joints, ", "));
    }
    line("]");
  }

  /// One table for all joints of a drive and its gains, but for those with limits of their own.
  void joints() {
    line("\n# --- joints: their order is that of the boards");
    line("[joint_defaults]");
    line("encoder_counts_per_rev = {:.0f}  # guess: 20 bits; put your encoders' counts here",
         robot_.config.joints[0].encoder_counts_per_rev.value);
    line("motor_encoder_counts_per_rev = {:.0f}{}",
         robot_.config.joints[0].motor_encoder_counts_per_rev, kGuess);
    for (const GainSet& set : robot_.gains) {
      std::vector<std::pair<std::string, std::vector<std::string>>> groups;  // limits -> joints
      for (const hal::JointConfig& joint : robot_.config.joints) {
        if (joint.gains != set.gains.name) continue;
        const std::string own = limits(joint);
        auto group = std::ranges::find(groups, own, &decltype(groups)::value_type::first);
        if (group == groups.end()) group = groups.insert(groups.end(), {own, {}});
        group->second.push_back(quoted_text(joint.name));
      }
      for (const auto& [own, names] : groups) {
        line("\n[[joint]]\nnames = [{}]", fmt::join(names, ", "));
        drive(set);
        text_ += own;
      }
    }
  }

  void drive(const GainSet& set) {
    const hal::JointConfig& one =
        *std::ranges::find(robot_.config.joints, set.gains.name, &hal::JointConfig::gains);
    line("actuator = \"{}\"", one.actuator);
    if (one.gains != one.actuator) line("gains = \"{}\"", one.gains);
  }

  /// The lines of what is not the description's own.
  [[nodiscard]] std::string limits(const hal::JointConfig& joint) const {
    const JointLimits& limit = robot_.limits[robot_.tree.joint_index(joint.name)];
    std::string text;
    if (limit.range.guessed) {
      text += fmt::format(
          "min_position_rad = {}  # guess: the description has no range\n"
          "max_position_rad = {}  # guess\n",
          number(joint.min_position_rad), number(joint.max_position_rad));
    } else if (is_soft(joint)) {
      text += fmt::format(
          "min_position_rad = {}  # the description's soft limits\nmax_position_rad = {}\n",
          number(joint.min_position_rad), number(joint.max_position_rad));
    }
    if (limit.effort_guessed) {
      text += fmt::format(
          "max_torque_Nm = {}  # guess: from its load and its neighbours'; the description's is "
          "{}\n",
          number(joint.max_torque_Nm), stated(joint.name, true));
    }
    if (limit.velocity_guessed) {
      text += fmt::format("max_velocity_rad_s = {}  # guess; the description's is {}\n",
                          number(joint.max_velocity_rad_s), stated(joint.name, false));
    }
    text += rates(joint);
    if (joint.slides) {
      text += fmt::format("following_error_rad = {}  # guess, in m: the way of 0.1 s at most\n",
                          number(joint.following_error_rad));
    }
    return text;
  }

  /// Whether a soft limit of the description is the joint's limit.
  [[nodiscard]] bool is_soft(const hal::JointConfig& joint) const {
    const auto own = robot_.extras.find(joint.name);
    return own != robot_.extras.end() && (joint.min_position_rad == own->second.soft_lower ||
                                          joint.max_position_rad == own->second.soft_upper);
  }

  /// The description's acceleration and jerk; a jerk needs an acceleration.
  [[nodiscard]] static std::string rates(const hal::JointConfig& joint) {
    std::string text;
    const bool jerk = std::isfinite(joint.max_jerk_rad_s3);
    if (std::isfinite(joint.max_acceleration_rad_s2)) {
      text = fmt::format("max_acceleration_rad_s2 = {}  # the description's\n",
                         number(joint.max_acceleration_rad_s2));
    } else if (jerk) {
      text = fmt::format("max_acceleration_rad_s2 = {}  # guess\n",
                         number(joint.max_velocity_rad_s / hal::kFullSpeed_s));
    }
    if (jerk) {
      text +=
          fmt::format("max_jerk_rad_s3 = {}  # the description's\n", number(joint.max_jerk_rad_s3));
    }
    return text;
  }

  [[nodiscard]] std::string stated(const std::string& joint, bool effort) const {
    const model::Joint& j = robot_.tree.joints[robot_.tree.joint_index(joint)];
    const double value = effort ? j.effort : j.velocity;
    return std::isfinite(value) ? number(value) : "missing";
  }

  void sensors() {
    for (std::size_t i = 0; i < robot_.sensors.size(); ++i) {
      const hal::SensorConfig& s = robot_.config.sensors[i];
      text_ += '\n';
      if (!robot_.sensors[i].guess.empty()) line("# guess: {}", robot_.sensors[i].guess);
      const bool wrench = s.type == hal::SensorType::kForceTorque;
      line("[[sensor]]\nname = {}\ntype = \"{}\"\nbus = {}", quoted_text(s.name),
           wrench ? "force_torque" : "imu", quoted_text(s.bus));
      if (wrench) line("joint = {}", quoted_text(s.joint));
      line("link = {}", quoted_text(s.link));
    }
  }

  void contact() {
    const hal::ContactConfig& c = robot_.config.contact;
    line("\n# guess: a firm floor, into which the robot sinks by 1.5 mm");
    Keys floor;
    add(floor, "stiffness_N_m", c.stiffness_N_m);
    add(floor, "damping_s_m", c.damping_s_m);
    add(floor, "tangential_stiffness_N_m", c.tangential_stiffness_N_m);
    add(floor, "tangential_damping_Ns_m", c.tangential_damping_Ns_m);
    add(floor, "static_friction", c.static_friction);
    add(floor, "sliding_friction", c.sliding_friction);
    table("contact", floor);
    for (std::size_t f = 0; f < c.feet.size(); ++f) {
      std::vector<std::string> points;
      for (const auto& p : c.feet[f].points_m)
        points.push_back(fmt::format("[{:.5g}]", fmt::join(p, ", ")));
      line("\n[[contact.foot]]\nsite = {}\npoints_m = [{}]{}", quoted_text(c.feet[f].site),
           fmt::join(points, ", "), robot_.feet[f].guess.empty() ? kFromShapes : kGuess);
    }
  }

  void posture() {
    const hal::PostureConfig& p = robot_.config.postures[0];
    if (robot_.stands_m > 0.0) {
      line("\n# guess: feet level, {:.2f} of the greatest height, centre of mass over the feet",
           robot_.stands_share);
      line("[posture.{}]\nbase_height_m = \"auto\"  # the lowest point touches: {:.4f}",
           key_of(p.name), p.base_height_m);
    } else {
      line("\n# guess: within all limits, and away from stretched limbs");
      line("[posture.{}]", key_of(p.name));
    }
    for (std::size_t j = 0; j < p.position_rad.size(); ++j) {
      const double value = std::round(p.position_rad[j] * 1e4) / 1e4;
      if (value == 0.0) continue;
      line("{} = {}{}", key_of(robot_.config.joints[j].name), number(value), kGuess);
    }
  }

  const NewRobot& robot_;
  const std::string& urdf_;
  const std::string& source_;
  std::string text_;
};

}  // namespace

std::string robot_text(const NewRobot& robot, const std::string& urdf_file,
                       const std::string& source) {
  return Writer(robot, urdf_file, source).run();
}

}  // namespace tandem::scaffold
