#include "apps/robot/robot_files.hpp"

#include "apps/robot/loop_facts.hpp"
#include "apps/robot/unused_limits.hpp"
#include "base/open_file.hpp"
#include "hal/sim/setup.hpp"
#include "model/regular.hpp"
#include "runtime/experiment.hpp"

namespace tandem::apps {

std::string text_of(const std::string& file) {
  return read_file(file, {}, kMostUrdfBytes).value_or("");
}

namespace {

/// The postures as states of the tree.
std::vector<model::NamedPosition> positions_of(const hal::RobotConfig& robot,
                                               const model::Tree& tree) {
  std::vector<model::NamedPosition> all;
  for (const hal::PostureConfig& posture : robot.postures) {
    model::NamedPosition one{"in the posture '" + posture.name + "'",
                             std::vector<double>(tree.joints.size(), 0.0)};
    for (std::size_t i = 0; i < robot.joints.size(); ++i) {
      const int joint = tree.joint_index(robot.joints[i].name);
      if (joint >= 0) one.position[static_cast<std::size_t>(joint)] = posture.position_rad[i];
    }
    all.push_back(std::move(one));
  }
  return all;
}

}  // namespace

std::optional<Error> falls_for_ever(const hal::RobotConfig& robot) {
  const auto& gravity = robot.model.gravity_m_s2;
  const bool pulled = std::ranges::any_of(gravity, [](double g) { return g != 0.0; });
  if (!robot.model.floating_base || !robot.contact.feet.empty() || !pulled) return std::nullopt;
  return Error{
      .message = "the base floats and there is no [contact]: the simulated robot falls for ever",
      .hint = "add [contact] with the robot's feet, or base = \"fixed\"",
      .file = robot.file,
      .key = "model.base"};
}

std::expected<RobotFiles, Diagnostics> with_description(hal::RobotConfig config,
                                                        runtime::FileTexts read) {
  auto description = runtime::complete_robot(config, read);
  if (!description) return std::unexpected(description.error());
  if (Diagnostics errors = check_loop_bodies(config, description->tree); !errors.empty()) {
    return std::unexpected(std::move(errors));
  }
  model::ModelSpec spec = sim::model_spec(config);
  const Status regular =
      model::check_regular(description->tree, spec, positions_of(config, description->tree));
  if (!regular) {
    Error error = regular.error();
    if (error.file.empty()) error.file = config.file;
    return std::unexpected(Diagnostics{std::move(error)});
  }
  if (auto warning = falls_for_ever(config)) description->warnings.push_back(std::move(*warning));
  for (Error& warning : unused_limits(config, description->tree))
    description->warnings.push_back(std::move(warning));
  return RobotFiles{std::move(config),         std::move(description->tree),     std::move(spec),
                    description->right_angles, std::move(description->warnings), std::move(read)};
}

std::expected<RobotFiles, Diagnostics> read_robot(const std::string& file, bool repair) {
  auto robot = runtime::read_robot(file, repair);
  if (!robot) return std::unexpected(robot.error());
  return with_description(std::move(robot->config), std::move(robot->files));
}

bool is_robot(const std::string& file) {
  const Result<TomlDocument> document = TomlDocument::load(file);
  return document && document->root().has("model");
}

}  // namespace tandem::apps
