#include "robot/robot_files.hpp"

#include "base/open_file.hpp"
#include "base/toml_reader.hpp"
#include "hal/sim/setup.hpp"
#include "model/regular.hpp"
#include "robot/closure_study.hpp"

namespace tandem::robot {

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

std::expected<RobotFiles, Diagnostics> join(hal::RobotConfig config,
                                            const model::UrdfModel& description, FileTexts files) {
  if (Diagnostics errors = check_loop_bodies(config, description.tree); !errors.empty()) {
    return std::unexpected(std::move(errors));
  }
  model::ModelSpec spec = sim::model_spec(config);
  const Status regular =
      model::check_regular(description.tree, spec, positions_of(config, description.tree));
  if (!regular) {
    Error error = regular.error();
    if (error.file.empty()) error.file = config.file;
    return std::unexpected(Diagnostics{std::move(error)});
  }
  return RobotFiles{std::move(config),        description.tree,     std::move(spec),
                    description.right_angles, description.warnings, std::move(files)};
}

std::expected<RobotFiles, Diagnostics> with_description(hal::RobotConfig config, FileTexts read) {
  const auto description = complete_robot(config, read);
  if (!description) return std::unexpected(description.error());
  return join(std::move(config), *description, std::move(read));
}

std::expected<RobotFiles, Diagnostics> read_robot(const std::string& file, bool repair,
                                                  const std::vector<TomlSetting>& settings) {
  auto robot = read_complete_robot(file, repair, settings);
  if (!robot) return std::unexpected(robot.error());
  return join(std::move(robot->config), robot->description, std::move(robot->files));
}

bool is_robot(const std::string& file) {
  const Result<TomlDocument> document = TomlDocument::load(file);
  return document && document->root().has("model");
}

}  // namespace tandem::robot
