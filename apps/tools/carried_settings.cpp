#include "apps/tools/carried_settings.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <filesystem>

namespace tandem::apps {
namespace {

using Names = std::vector<std::string>;

/// Whether a key needs no quotes. A log may be anybody's, and its keys become lines of a file.
bool is_plain(const std::string& key) {
  return key.find_first_not_of("abcdefghijklmnopqrstuvwxyz_0123456789.") == std::string::npos;
}

/// @param wanted  keys to take; empty: all
void carry_table(TomlTable& root, const std::string& name, const Names& wanted,
                 CarriedSettings& carried) {
  std::string lines;
  for (const auto& [key, value] : root.table_or_empty(name).values()) {
    if (!is_plain(key) || (!wanted.empty() && std::ranges::find(wanted, key) == wanted.end()))
      continue;
    lines += key + " = " + value + "\n";
    carried.keys.push_back(name + "." + key);
  }
  if (!lines.empty()) carried.tables += "\n[" + name + "]\n" + lines;
}

/// The joints between the base and these feet.
Names leg_joints(const robot::RobotFiles& robot, const Names& feet) {
  Names names;
  const model::Tree& tree = robot.tree;
  for (const hal::SiteConfig& site : robot.config.model.sites) {
    const int link = tree.link_index(site.link);
    if (link < 0 || std::ranges::find(feet, site.name) == feet.end()) continue;
    for (int body = tree.links[static_cast<std::size_t>(link)].body; body > 0;) {
      const model::Joint& joint = tree.joints[static_cast<std::size_t>(body - 1)];
      names.push_back(joint.name);
      body = joint.parent;
    }
  }
  return names;
}

/// Adds the damping by one [[controller]] of the log's experiment.
void carry_damping(TomlTable& controller, const robot::RobotFiles& robot,
                   CarriedSettings& carried) {
  const std::string plugin = std::filesystem::path(controller.text_or("plugin", "")).stem();
  if (!controller.boolean_or("active", true)) return;
  TomlTable parameters = controller.table_or_empty("parameters");
  Names joints, feet;
  for (const hal::JointConfig& joint : robot.config.joints) joints.push_back(joint.name);
  for (const hal::Foot& foot : robot.config.contact.feet) feet.push_back(foot.site);
  const Names all = joints;
  const std::string key = "link_damping_Nms_rad";
  if (plugin == "squat") {
    joints = leg_joints(robot, parameters.texts_or("feet", feet));
  } else if (plugin == "hold" || plugin == "joint_trajectory" || plugin == "recorded_motion") {
    joints = parameters.texts_or("joints", joints);
  } else {
    return;
  }
  const auto values = parameters.values();
  std::vector<double> each;
  const auto given = values.find(key);
  const bool is_list = given != values.end() && given->second.starts_with('[');
  if (is_list) each = parameters.numbers_or(key, {}, kNotNegative);
  for (std::size_t i = 0; i < joints.size(); ++i) {
    const std::string& joint = joints[i];
    if (std::ranges::find(all, joint) == all.end()) continue;
    double damping = i < each.size() ? each[i] : 0.0;
    if (given != values.end() && !is_list) damping = parameters.number_or(key, 0.0, kNotNegative);
    if (values.contains(key + "." + joint))
      damping = parameters.table(key).number_or(joint, 0.0, kNotNegative);
    if (damping > 0.0) carried.damping_Nms_rad[joint] = damping;
  }
}

}  // namespace

std::optional<TomlDocument> experiment_of(const log::RunInfo& info) {
  for (const auto& [file, text] : info.configuration) {
    if (!file.ends_with(".toml")) continue;
    auto document = TomlDocument::parse(text, file);
    if (document && document->root().has("robot")) return std::move(*document);
  }
  return std::nullopt;
}

CarriedSettings carried_settings(const log::RunInfo& info, const robot::RobotFiles& robot) {
  CarriedSettings carried;
  const std::optional<TomlDocument> experiment = experiment_of(info);
  if (!experiment) return carried;
  TomlTable root = experiment->root();
  carried.seed = info.seed;  // --seed may have been given
  carried.keys.emplace_back("seed");
  if (root.has("period_ns") && info.period_ns > 0) {
    carried.period_ns = info.period_ns;
    carried.keys.emplace_back("period_ns");
  }
  carry_table(root, "sim", {}, carried);
  carry_table(root, "hal", {"answer_window", "delay_cycles", "settle_s"}, carried);
  carry_table(root, "faults", {"fall"}, carried);
  for (TomlTable& controller : root.tables("controller")) carry_damping(controller, robot, carried);
  if (!carried.damping_Nms_rad.empty()) carried.keys.emplace_back("link_damping_Nms_rad");
  return carried;
}

}  // namespace tandem::apps
