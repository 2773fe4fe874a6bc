// The texts of a MoveIt package, in the layout that MoveItConfigsBuilder looks for. Numbers of its
// YAML have a point: ROS 2 takes others for integers, and refuses them.
#include <fmt/format.h>
#include <tinyxml2.h>

#include <algorithm>
#include <cctype>
#include <cmath>

#include "base/quoting.hpp"
#include "base/xml_scan.hpp"
#include "model/urdf_write.hpp"
#include "scaffold/moveit.hpp"
#include "scaffold/moveit_text.hpp"

namespace tandem::scaffold {
namespace {

constexpr int kPlaceAndDirection = 6;  // joints that a chain needs to reach both

/// A float as YAML 1.1 reads one: with a point.
std::string yaml_number(double value) {
  std::string text = fmt::format("{}", value + 0.0);
  if (text.find('.') != std::string::npos) return text;
  const std::size_t exponent = std::min(text.find('e'), text.size());
  return text.insert(exponent, ".0");
}

/// A name as YAML reads a text and nothing else: `on`, `y` and `1` are none.
std::string yaml_text(const std::string& name) { return quoted_text(name); }

/// What a package of ROS 2 may be called: lower case letters, digits and single `_`.
std::string plain_name(const std::string& name) {
  std::string plain;
  for (const unsigned char c : name) {
    const bool letter = c < 128 && std::isalnum(c) != 0;
    if (letter) plain += static_cast<char>(std::tolower(c));
    if (!letter && !plain.empty() && plain.back() != '_') plain += '_';
  }
  while (plain.ends_with('_')) plain.pop_back();
  return plain.empty() || std::isalpha(static_cast<unsigned char>(plain[0])) == 0
             ? "robot" + (plain.empty() ? "" : "_" + plain)
             : plain;
}

/// What MoveIt cannot be told of the robot.
Status check_describable(const hal::RobotConfig& robot, std::string_view urdf) {
  if (!robot.loops.empty()) {
    return fail("the robot closes kinematic loops, and MoveIt plans for trees alone",
                "describe a robot without [[loop]] to MoveIt");
  }
  if (robot.model.mimic_independent && urdf.find("<mimic") != std::string_view::npos) {
    return fail("with mimic = \"independent\" its drives move joints that follow others for MoveIt",
                "take <mimic> out of the description");
  }
  tinyxml2::XMLDocument document;
  const std::string plain = without_instructions(urdf);
  if (document.Parse(plain.data(), plain.size()) != tinyxml2::XML_SUCCESS ||
      document.RootElement() == nullptr) {
    return fail("the description is no XML", "name a URDF");
  }
  const auto* joint = document.RootElement()->FirstChildElement("joint");
  for (; joint != nullptr; joint = joint->NextSiblingElement("joint")) {
    const char* type = joint->Attribute("type");
    const char* name = joint->Attribute("name");
    if (type == nullptr || name == nullptr || std::string_view(type) != "floating") continue;
    if (std::ranges::find(robot.model.lock, std::string_view(name),
                          &std::pair<std::string, double>::first) != robot.model.lock.end())
      continue;
    return fail("joint '" + std::string(name) +
                    "' of the description is a floating one, which MoveIt knows as a virtual joint",
                "take it and its parent link out of the description: [model] base says the same");
  }
  return {};
}

/// The description as the robot has it: what [model.lock] holds is fixed.
Result<std::string> locked(const hal::RobotConfig& robot, const model::Tree& tree,
                           std::string_view urdf) {
  std::vector<std::pair<std::string, model::Placement>> fixed;
  for (const auto& [joint, position] : robot.model.lock) {
    const int index = tree.child_link_index(joint);
    if (index < 0) continue;  // the reader has refused it
    const model::Link& link = tree.links[static_cast<std::size_t>(index)];
    const model::Placement& parent = tree.links[static_cast<std::size_t>(link.parent)].in_body;
    const Eigen::Matrix3d back = parent.R.transpose();
    fixed.emplace_back(joint,
                       model::Placement{back * link.in_body.R, back * (link.in_body.p - parent.p)});
  }
  return model::with_fixed(urdf, fixed);
}

/// Writes the files one after the other; each uses what was found out before.
class PackageWriter {
 public:
  PackageWriter(const hal::RobotConfig& robot, const model::Tree& tree, const std::string& action)
      : robot_(robot), tree_(tree), action_(action), name_(plain_name(robot.name)) {
    package_.name = name_ + "_moveit_config";
    package_.groups = moveit_groups(tree, robot.model.sites);
  }

  MoveItPackage run(const std::string& urdf) {
    warn();
    add("package.xml", package_xml(package_.name, robot_.name, urdf));
    add("CMakeLists.txt", cmake_text(package_.name));
    add(".setup_assistant", setup_assistant(package_.name, name_));
    add("config/" + name_ + ".urdf", urdf);
    add("config/" + name_ + ".srdf", srdf());
    add("config/kinematics.yaml", kinematics());
    add("config/joint_limits.yaml", joint_limits());
    add("config/pilz_cartesian_limits.yaml", cartesian_limits());
    add("config/moveit_controllers.yaml", controllers());
    add("config/initial_positions.yaml", initial_positions());
    add("config/moveit.rviz", rviz_text());
    add("launch/moveit.launch.py", launch_text(package_.name, name_));
    return std::move(package_);
  }

 private:
  void add(const std::string& path, std::string text) {
    package_.files.emplace_back(path, std::move(text));
  }
  void warn(std::string message, std::string hint) {
    package_.warnings.push_back({std::move(message), std::move(hint), robot_.file, 0, {}});
  }
  void warn();
  [[nodiscard]] const model::Joint& joint_at(int index) const {
    return tree_.joints[static_cast<std::size_t>(index)];
  }
  /// Those with a drive.
  [[nodiscard]] std::vector<std::string> driven(const MoveItGroup& group) const {
    std::vector<std::string> names;
    for (const int j : group.joints)
      if (!joint_at(j).follows()) names.push_back(joint_at(j).name);
    return names;
  }
  [[nodiscard]] std::string srdf() const;
  [[nodiscard]] std::string kinematics() const;
  [[nodiscard]] std::string joint_limits() const;
  [[nodiscard]] static std::string cartesian_limits();
  [[nodiscard]] std::string controllers() const;
  [[nodiscard]] std::string initial_positions() const;

  const hal::RobotConfig& robot_;
  const model::Tree& tree_;
  const std::string& action_;
  std::string name_;
  MoveItPackage package_;
};

/// The first of many names.
std::string some_of(const std::vector<std::string>& names) {
  constexpr std::size_t kMost = 3;
  if (names.size() <= kMost) return fmt::format("{}", fmt::join(names, ", "));
  return fmt::format("{} and {} more", fmt::join(names.begin(), names.begin() + kMost, ", "),
                     names.size() - kMost);
}

/// What a user has to know of what is written.
void PackageWriter::warn() {
  std::vector<std::string> guessed, continuous;
  for (const hal::JointConfig& joint : robot_.joints) {
    if (joint.max_acceleration_rad_s2 == joint.max_velocity_rad_s / hal::kFullSpeed_s)
      guessed.push_back(joint.name);
    const int index = tree_.joint_index(joint.name);
    if (index >= 0 && joint_at(index).type == model::JointType::kContinuous)
      continuous.push_back(joint.name);
  }
  if (!guessed.empty()) {
    warn(fmt::format("joints without max_acceleration_rad_s2: {}: what is written is the limit "
                     "that a run then keeps, a guess, which can ask for more torque than they have",
                     some_of(guessed)),
         "give each [[joint]] its own, then write the package again");
  }
  if (!continuous.empty()) {
    warn(fmt::format("joints that are continuous in the description: {}: MoveIt knows no limits of "
                     "their positions, and a run refuses what is beyond robot.toml's",
                     some_of(continuous)),
         "make them revolute in the description");
  }
}

std::string PackageWriter::srdf() const {
  std::string text = fmt::format(
      "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<robot name=\"{}\">\n", xml_text(tree_.name));
  for (const MoveItGroup& group : package_.groups) {
    text += "  <group name=\"" + group.name + "\">\n";
    if (!group.base_link.empty()) {
      text += fmt::format("    <chain base_link=\"{}\" tip_link=\"{}\"/>\n",
                          xml_text(group.base_link), xml_text(group.tip_link));
    } else {
      for (const int j : group.joints)
        text += "    <joint name=\"" + xml_text(joint_at(j).name) + "\"/>\n";
    }
    text += "  </group>\n";
  }
  for (const hal::PostureConfig& posture : robot_.postures) {
    for (const MoveItGroup& group : package_.groups) {
      text += fmt::format("  <group_state name=\"{}\" group=\"{}\">\n", xml_text(posture.name),
                          group.name);
      for (const std::string& joint : driven(group)) {
        const auto index = static_cast<std::size_t>(robot_.joint_index(joint));
        text += fmt::format("    <joint name=\"{}\" value=\"{}\"/>\n", xml_text(joint),
                            yaml_number(posture.position_rad[index]));
      }
      text += "  </group_state>\n";
    }
  }
  for (const MoveItGroup& group : package_.groups) {
    if (group.carrier < 0 || group.on.empty()) continue;
    text += fmt::format(
        "  <end_effector name=\"{0}\" parent_link=\"{1}\" group=\"{0}\" parent_group=\"{2}\"/>\n",
        group.name, xml_text(group.on),
        package_.groups[static_cast<std::size_t>(group.carrier)].name);
  }
  text += fmt::format(
      "  <!-- odom is what a run's tf calls the world. -->\n"
      "  <virtual_joint name=\"odom_joint\" type=\"{}\" parent_frame=\"odom\" "
      "child_link=\"{}\"/>\n",
      tree_.floating_base ? "floating" : "fixed", xml_text(tree_.links[0].name));
  const auto pairs = neighbours(tree_);
  if (!pairs.empty()) {
    text +=
        "  <!-- Links that are fixed to each other, or have a joint between them. Which others "
        "never or always\n       touch is for MoveIt's setup assistant to find: it has the "
        "meshes. -->\n";
  }
  for (const auto& [a, b] : pairs) {
    text += fmt::format("  <disable_collisions link1=\"{}\" link2=\"{}\" reason=\"Adjacent\"/>\n",
                        xml_text(a), xml_text(b));
  }
  return text + "</robot>\n";
}

std::string PackageWriter::kinematics() const {
  std::string text = "# How places of a group's tip become positions of its joints.\n";
  bool none = true;
  for (const MoveItGroup& group : package_.groups) {
    if (group.base_link.empty()) continue;
    none = false;
    text += group.name + ":\n  kinematics_solver: kdl_kinematics_plugin/KDLKinematicsPlugin\n" +
            "  kinematics_solver_search_resolution: 0.005\n  kinematics_solver_timeout: 0.05\n";
    if (driven(group).size() < kPlaceAndDirection)
      text += "  position_only_ik: true  # too few joints for a direction as well\n";
  }
  return none ? text + "{}\n" : text;
}

std::string PackageWriter::joint_limits() const {
  std::string text =
      "# The limits of robot.toml, which a run keeps. Plans use a tenth of them, unless asked "
      "otherwise.\n"
      "default_velocity_scaling_factor: 0.1\ndefault_acceleration_scaling_factor: 0.1\n"
      "joint_limits:\n";
  for (const hal::JointConfig& joint : robot_.joints) {
    const int index = tree_.joint_index(joint.name);
    text += "  " + yaml_text(joint.name) + ":\n";
    if (index < 0 || joint_at(index).type != model::JointType::kContinuous) {
      text +=
          fmt::format("    has_position_limits: true\n    min_position: {}\n    max_position: {}\n",
                      yaml_number(joint.min_position_rad), yaml_number(joint.max_position_rad));
    }
    text += fmt::format("    has_velocity_limits: true\n    max_velocity: {}\n",
                        yaml_number(joint.max_velocity_rad_s));
    text += fmt::format("    has_acceleration_limits: true\n    max_acceleration: {}\n",
                        yaml_number(joint.max_acceleration_rad_s2));
    if (std::isfinite(joint.max_jerk_rad_s3)) {
      text += fmt::format("    has_jerk_limits: true\n    max_jerk: {}\n",
                          yaml_number(joint.max_jerk_rad_s3));
    }
  }
  return text;
}

std::string PackageWriter::cartesian_limits() {
  return R"(# MoveIt's builder wants this file, for the planner Pilz, which moveit.launch.py does not load. The
# robot says nothing of it: these are plausible, no more.
cartesian_limits:
  max_trans_vel: 0.25
  max_trans_acc: 0.5
  max_trans_dec: -0.5
  max_rot_vel: 0.5
)";
}

std::string PackageWriter::controllers() const {
  std::string names, each;
  for (std::size_t g = 0; g < package_.groups.size(); ++g) {
    const std::string name = yaml_text(moveit_controller(package_.groups, g, action_));
    names += "    - " + name + "\n";
    each += fmt::format(
        "  {}:\n    type: FollowJointTrajectory\n    action_ns: follow_joint_trajectory\n"
        "    default: true\n    joints:\n",
        name);
    for (const std::string& joint : driven(package_.groups[g]))
      each += "      - " + yaml_text(joint) + "\n";
  }
  return "# Each is the action NAME/follow_joint_trajectory of a run, for these joints.\n"
         "moveit_controller_manager: "
         "moveit_simple_controller_manager/MoveItSimpleControllerManager\n"
         "moveit_simple_controller_manager:\n  controller_names:\n" +
         names + each;
}

std::string PackageWriter::initial_positions() const {
  const bool some = !robot_.postures.empty();
  std::string text =
      some ? fmt::format("# Posture {} of robot.toml.\n", shown(robot_.postures[0].name))
           : "# robot.toml has no posture: 0, or the limit next to it.\n";
  text += "initial_positions:\n";
  for (std::size_t j = 0; j < robot_.joints.size(); ++j) {
    const hal::JointConfig& joint = robot_.joints[j];
    const double at = some ? robot_.postures[0].position_rad[j]
                           : std::clamp(0.0, joint.min_position_rad, joint.max_position_rad);
    text += "  " + yaml_text(joint.name) + ": " + yaml_number(at) + "\n";
  }
  return text;
}

}  // namespace

Result<MoveItPackage> make_moveit_package(const hal::RobotConfig& robot, const model::Tree& tree,
                                          std::string_view urdf, const std::string& action) {
  if (Status describable = check_describable(robot, urdf); !describable)
    return std::unexpected(describable.error());
  const Result<std::string> text = locked(robot, tree, urdf);
  if (!text) return std::unexpected(text.error());
  return PackageWriter(robot, tree, action).run(*text);
}

}  // namespace tandem::scaffold
