#include "apps/robot_files.hpp"

#include <fstream>
#include <sstream>

#include "hal/sim/setup.hpp"
#include "runtime/experiment.hpp"

namespace tandem::apps {

std::string text_of(const std::string& file) {
  std::ifstream in(file, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

std::expected<RobotFiles, Diagnostics> with_description(hal::RobotConfig config) {
  auto description = runtime::complete_robot(config);
  if (!description) return std::unexpected(description.error());
  model::ModelSpec spec = sim::model_spec(config);
  return RobotFiles{std::move(config), std::move(description->tree), std::move(spec),
                    description->right_angles, std::move(description->warnings)};
}

std::expected<RobotFiles, Diagnostics> read_robot(const std::string& file) {
  auto robot = runtime::read_robot(file);
  if (!robot) return std::unexpected(robot.error());
  return with_description(std::move(robot->config));
}

bool is_robot(const std::string& file) {
  const Result<TomlDocument> document = TomlDocument::load(file);
  return document && document->root().has("model");
}

}  // namespace tandem::apps
