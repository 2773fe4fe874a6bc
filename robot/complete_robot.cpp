#include "robot/complete_robot.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "robot/posture.hpp"

namespace tandem::robot {

namespace {

/// @param file  the robot.toml
model::UrdfOptions urdf_options(const hal::ModelConfig& model, const std::string& file) {
  model::UrdfOptions options{.floating_base = model.floating_base,
                             .mimic_independent = model.mimic_independent,
                             .lock = model.lock,
                             .repair_inertia = model.repair_inertia,
                             .exact_right_angles = model.exact_right_angles,
                             .lock_lines = model.lock_lines,
                             .overrides_file = file};
  for (const hal::LinkConfig& link : model.links) {
    options.links.push_back(
        {link.name, link.mass_kg, link.com_m, link.inertia_kg_m2, link.line, link.file, link.key});
  }
  return options;
}

std::expected<model::UrdfModel, Diagnostics> read_description(const hal::RobotConfig& robot,
                                                              const FileTexts& read = {}) {
  const model::UrdfOptions options = urdf_options(robot.model, robot.file);
  const std::string text = text_in(read, robot.model.urdf);
  return text.empty() ? model::read_urdf(robot.model.urdf, options)
                      : model::parse_urdf(text, robot.model.urdf, options);
}

hal::RobotDescription plain(const model::UrdfModel& model) {
  hal::RobotDescription description;
  for (const model::Joint& joint : model.tree.joints) {
    if (joint.follows()) {
      const model::Joint& leader = model.tree.joints[static_cast<std::size_t>(joint.leader)];
      const model::Travel range = joint.leaders_range();
      description.followers.push_back({joint.name, leader.name, range.lower, range.upper});
      continue;
    }
    const auto note = model.limits_notes.find(joint.name);
    description.moving_joints.push_back({joint.name, joint.lower, joint.upper, joint.velocity,
                                         joint.effort,
                                         note == model.limits_notes.end() ? "" : note->second,
                                         joint.type == model::JointType::kPrismatic});
  }
  for (const model::Link& link : model.tree.links) {
    description.links.push_back(link.name);
    if (link.moving < 0 && !link.joint.empty()) description.other_joints.push_back(link.joint);
  }
  return description;
}

}  // namespace

std::string text_in(const FileTexts& files, const std::string& path) {
  const auto found = std::ranges::find(files, path, &std::pair<std::string, std::string>::first);
  return found == files.end() ? std::string() : found->second;
}

std::vector<hal::Follower> followers_of(const hal::RobotConfig& robot, const model::Tree& tree) {
  std::vector<hal::Follower> all;
  for (const model::Joint& joint : tree.joints) {
    if (!joint.follows()) continue;
    const int leader = robot.joint_index(tree.joints[static_cast<std::size_t>(joint.leader)].name);
    if (leader < 0) continue;  // it has no drive either
    all.push_back({joint.name, static_cast<std::size_t>(leader), joint.multiplier, joint.offset});
  }
  return all;
}

std::expected<model::UrdfModel, Diagnostics> complete_robot(hal::RobotConfig& robot,
                                                            const FileTexts& read) {
  auto found = read_description(robot, read);
  if (!found) return found;
  Diagnostics errors = hal::complete_from_description(robot, plain(*found));
  sort_by_line(errors);
  if (!errors.empty()) return std::unexpected(std::move(errors));
  robot.followers = followers_of(robot, found->tree);
  for (hal::PostureConfig& posture : robot.postures) {
    if (!std::isnan(posture.base_height_m)) continue;
    const std::optional<StandingHeight> touching = standing(robot, posture, found->tree);
    posture.base_height_m = touching ? touching->base_height_m : 0.0;
  }
  return found;
}

std::expected<CompleteRobot, Diagnostics> read_complete_robot(
    const std::string& file, bool repair, const std::vector<TomlSetting>& settings) {
  Diagnostics errors;
  std::vector<hal::JointReference> loose;
  const Result<TomlDocument> document = TomlDocument::load(file, hal::kRobotOfXml, settings);
  hal::RobotConfig config = hal::read_robot_config(document, errors, loose);
  config.model.repair_inertia = config.model.repair_inertia || repair;
  if (errors.empty() && loose.empty()) {
    auto description = complete_robot(config);
    if (!description) return std::unexpected(description.error());
    FileTexts files{{file, document->text()}, {config.model.urdf, *description->text}};
    return CompleteRobot{std::move(config), std::move(*description), std::move(files)};
  }
  // The file is wrong by itself; what can be said of its names beside that is said too.
  const auto description =
      config.model.urdf.empty() ? std::unexpected(Diagnostics{}) : read_description(config);
  const Diagnostics names = description ? hal::check_names(config, plain(*description), loose)
                                        : hal::check_names(config, loose);
  errors.insert(errors.end(), names.begin(), names.end());
  sort_by_line(errors);
  if (!description) {
    errors.insert(errors.end(), description.error().begin(), description.error().end());
  }
  return std::unexpected(errors);
}

}  // namespace tandem::robot
