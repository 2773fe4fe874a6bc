// robot.toml of a new robot.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "scaffold/new_robot.hpp"

namespace tandem::scaffold {
namespace {

std::string number(double value) { return fmt::format("{:.6g}", value); }

std::string loop(const char* name, const hal::PidGains& g) {
  std::string text = fmt::format("{} = {{ kp = {}", name, number(g.kp));
  if (g.ki > 0.0) text += ", ki = " + number(g.ki);
  if (g.kd > 0.0) text += ", kd = " + number(g.kd);
  return text + " }\n";
}

class Writer {
 public:
  Writer(const NewRobot& robot, const std::string& urdf, const std::string& source)
      : robot_(robot), urdf_(urdf), source_(source) {}

  std::string run() {
    head();
    model();
    sites();
    for (const DriveSize& drive : robot_.drives) actuator(drive);
    for (const GainSet& set : robot_.gains) gains(set);
    line("\n# --- wires: a bus a limb, CAN FD at 1 and 8 Mbit/s, two joints a board");
    line("[board_defaults]\nslow_pdo_every = {}  # motor currents and the like, every n-th cycle",
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
    line("# {}: {} joints, {} base, {:.2f} kg.", robot_.config.name, robot_.config.joints.size(),
         robot_.config.model.floating_base ? "floating" : "fixed", robot_.mass_kg);
    line("# Written by `tandem new` from {}. The description keeps its own licence: put its",
         source_);
    line("# notice beside this file before you pass the folder on.");
    for (const std::string& remark : robot_.remarks) line("# {}", remark);
    line("# Every key: docs/configuration.md. The rules behind the figures: docs/robots.md.");
    line("name = \"{}\"", robot_.config.name);
  }

  void model() {
    line("\n[model]\nurdf = \"{}\"\nbase = \"{}\"", urdf_,
         robot_.config.model.floating_base ? "floating" : "fixed");
    if (robot_.config.model.mimic_independent) line("mimic = \"independent\"");
    if (robot_.config.model.repair_inertia) line("inertia = \"repair\"");
  }

  void sites() {
    for (std::size_t i = 0; i < robot_.feet.size(); ++i) {
      const hal::SiteConfig& site = robot_.config.model.sites[i];
      text_ += '\n';
      if (!robot_.feet[i].guess.empty()) line("# guess: {}", robot_.feet[i].guess);
      line("[[site]]\nname = \"{}\"\nlink = \"{}\"", site.name, site.link);
      const auto set = [](const auto& v) {
        return std::ranges::any_of(v, [](double x) { return x != 0.0; });
      };
      if (set(site.xyz_m)) line("xyz_m = [{:.6g}]", fmt::join(site.xyz_m, ", "));
      if (set(site.rpy_rad)) line("rpy_rad = [{:.9g}]", fmt::join(site.rpy_rad, ", "));
      line("wrench = true");
    }
  }

  void actuator(const DriveSize& drive) {
    const hal::ActuatorConfig& a = drive.actuator;
    line("\n# guess: a {} drive for {}; put your motor's data sheet here",
         a.order < 2 ? "rigid" : "series elastic", drive.remark);
    line("[actuator.{}]\norder = {}", a.name, a.order);
    line("resistance_ohm = {}\ninductance_H = {}", number(a.resistance_ohm),
         number(a.inductance_H));
    line("torque_constant_Nm_A = {}\ngear_ratio = {}", number(a.torque_constant_Nm_A),
         number(a.gear_ratio));
    line("inertia_kg_m2 = {}\ndamping_Nms_rad = {}  # back-EMF included", number(a.inertia_kg_m2),
         number(a.damping_Nms_rad));
    if (a.order >= 2) {
      line("spring_Nm_rad = {}\nspring_damping_Nms_rad = {}", number(a.spring_Nm_rad),
           number(a.spring_damping_Nms_rad));
    }
    line("current_limit_A = {}\nvoltage_limit_V = {}", number(a.current_limit_A),
         number(a.voltage_limit_V));
    line("thermal_resistance_K_W = {}", number(a.thermal_resistance_K_W));
    if (a.continuous_current_A > 0.0) {
      line("continuous_current_A = {}\nthermal_time_s = {}", number(a.continuous_current_A),
           number(a.thermal_time_s));
    }
  }

  void gains(const GainSet& set) {
    const hal::GainsConfig& g = set.gains;
    line("\n# {}", set.remark);
    line("[gains.{}]", g.name);
    if (g.position_feedback == hal::PositionFeedback::kMotor) line("position_feedback = \"motor\"");
    text_ += loop("position", g.position.gains);
    text_ += loop("velocity", g.velocity.gains);
    if (g.torque.gains.kp > 0.0) text_ += loop("torque", g.torque.gains);
    text_ += loop("current", g.current.gains);
    line("emf_compensation = {}", number(g.emf_compensation));
    line("stiffness_Nm_rad = {}\ndamping_Nms_rad = {}", number(g.stiffness_Nm_rad),
         number(g.damping_Nms_rad));
  }

  void wire(const hal::BusConfig& bus) {
    line("\n[[bus]]\nname = \"{}\"\ninterface = \"{}\"\nboards = [", bus.name, bus.interface);
    for (const hal::BoardConfig& board : robot_.config.boards) {
      if (board.bus != bus.name) continue;
      std::vector<std::string> joints;
      for (const hal::JointConfig& joint : robot_.config.joints) {
        if (joint.board == board.name) joints.push_back('"' + joint.name + '"');
      }
      line("  {{ name = \"{}\", joints = [{}] }},", board.name, fmt::join(joints, ", "));
    }
    line("]");
  }

  /// One table for all joints of a drive and its gains, but for those with limits of their own.
  void joints() {
    line("\n# --- joints: their order is that of the boards");
    line("[joint_defaults]");
    line("encoder_counts_per_rev = {:.0f}  # guess: 20 bits; put your encoders' counts here",
         robot_.config.joints[0].encoder_counts_per_rev);
    line("motor_encoder_counts_per_rev = {:.0f}",
         robot_.config.joints[0].motor_encoder_counts_per_rev);
    for (const GainSet& set : robot_.gains) {
      std::vector<std::pair<std::string, std::vector<std::string>>> groups;  // limits -> joints
      for (const hal::JointConfig& joint : robot_.config.joints) {
        if (joint.gains != set.gains.name) continue;
        const std::string own = limits(joint);
        auto group = std::ranges::find(groups, own, &decltype(groups)::value_type::first);
        if (group == groups.end()) group = groups.insert(groups.end(), {own, {}});
        group->second.push_back('"' + joint.name + '"');
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
          "max_position_rad = {}\n",
          number(joint.min_position_rad), number(joint.max_position_rad));
    }
    if (limit.effort_guessed) {
      text += fmt::format(
          "max_torque_Nm = {}  # guess: twice gravity at its worst; the description's is {}\n",
          number(joint.max_torque_Nm), stated(joint.name, true));
    }
    if (limit.velocity_guessed) {
      text += fmt::format("max_velocity_rad_s = {}  # guess; the description's is {}\n",
                          number(joint.max_velocity_rad_s), stated(joint.name, false));
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
      line("[[sensor]]\nname = \"{}\"\ntype = \"{}\"\nbus = \"{}\"", s.name,
           wrench ? "force_torque" : "imu", s.bus);
      if (wrench) line("joint = \"{}\"", s.joint);
      line("link = \"{}\"", s.link);
    }
  }

  void contact() {
    const hal::ContactConfig& c = robot_.config.contact;
    line("\n# guess: a firm floor, into which the robot sinks by 1.5 mm");
    line("[contact]\nstiffness_N_m = {}\ndamping_s_m = {}", number(c.stiffness_N_m),
         number(c.damping_s_m));
    line("tangential_stiffness_N_m = {}\ntangential_damping_Ns_m = {}",
         number(c.tangential_stiffness_N_m), number(c.tangential_damping_Ns_m));
    line("static_friction = {}\nsliding_friction = {}", number(c.static_friction),
         number(c.sliding_friction));
    for (const hal::FootConfig& foot : c.feet) {
      std::vector<std::string> points;
      for (const auto& p : foot.points_m)
        points.push_back(fmt::format("[{:.5g}]", fmt::join(p, ", ")));
      line("\n[[contact.foot]]\nsite = \"{}\"\npoints_m = [{}]", foot.site,
           fmt::join(points, ", "));
    }
  }

  void posture() {
    const hal::PostureConfig& p = robot_.config.postures[0];
    if (robot_.stands_m > 0.0) {
      line(
          "\n# Feet level, knees bent to 0.94 of the greatest height, centre of mass over the "
          "feet.");
      line("[posture.{}]\nbase_height_m = {:.4f}", p.name, p.base_height_m);
    } else {
      line("\n# guess: within all limits, and away from stretched limbs");
      line("[posture.{}]", p.name);
    }
    for (std::size_t j = 0; j < p.position_rad.size(); ++j) {
      const double value = std::round(p.position_rad[j] * 1e4) / 1e4;
      if (value != 0.0) line("{} = {}", key(robot_.config.joints[j].name), number(value));
    }
  }

  /// A bare key where TOML allows it.
  static std::string key(const std::string& name) {
    const bool bare = std::ranges::all_of(
        name, [](unsigned char c) { return std::isalnum(c) != 0 || c == '_' || c == '-'; });
    return bare ? name : "\"" + name + "\"";
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
