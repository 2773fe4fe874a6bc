// Whatever bytes stand for an experiment: errors with a message, or one that a run can start from;
// and, by themselves, its changes of the plant.
#include <cmath>
#include <cstdint>
#include <string_view>

#include "base/toml_reader.hpp"
#include "robot/complete_robot.hpp"
#include "runtime/experiment.hpp"
#include "runtime/plant_options.hpp"
#include "tests/fuzz/require.hpp"

namespace {

using tandem::fuzz::require;

/// [sim.link], [sim.joint] and [[sim.payload]]: errors, or bodies that there can be.
void read_plant(std::string_view text) {
  static const auto kRobot =
      tandem::robot::read_complete_robot(TANDEM_SOURCE_DIR "/config/double_pendulum/robot.toml");
  require(kRobot.has_value());
  auto document = tandem::TomlDocument::parse(text, "fuzz/x.toml");
  if (!document) return;
  const auto plant = tandem::runtime::read_plant_changes(
      document->root().table_or_empty("sim"), kRobot->config, &kRobot->description, kRobot->files);
  if (plant == nullptr || !document->diagnostics().empty()) return;
  require(plant->tree.links.size() == kRobot->description.tree.links.size());
  for (const auto& link : plant->tree.links) {
    require(std::isfinite(link.inertia.mass_kg) && link.inertia.mass_kg >= 0.0);
  }
  require(plant->zero_error_rad.empty() ||
          plant->zero_error_rad.size() == plant->robot.joints.size());
  for (const auto& payload : plant->carried) require(payload.start_ns >= 0);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const auto kRobot =
      tandem::hal::read_robot_config(TANDEM_SOURCE_DIR "/config/double_pendulum/robot.toml");
  require(kRobot.has_value());
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  read_plant(text);
  auto experiment = tandem::runtime::parse_experiment(text, "fuzz/x.toml", *kRobot);
  if (!experiment.has_value()) {
    require(!experiment.error().empty());
    return 0;
  }
  require(experiment->duration_s > 0.0 && experiment->loop.period_ns > 0);
  require(experiment->loop.period_ns % experiment->sim.substep_ns == 0);
  require(!experiment->controllers.empty());
  (void)experiment->sim_robot_config();
  for (auto& controller : experiment->controllers) {  // as a controller reads them
    (void)controller.parameters.number("depth_m");
    (void)controller.parameters.numbers_or("gains", {});
    controller.parameters.finish();
  }
  return 0;
}
