// Whatever bytes stand for an experiment: errors with a message, or one that a run can start from.
#include <cstdint>
#include <string_view>

#include "runtime/experiment.hpp"
#include "tests/fuzz/require.hpp"

namespace {

using tandem::fuzz::require;

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const auto kRobot =
      tandem::hal::read_robot_config(TANDEM_SOURCE_DIR "/config/double_pendulum/robot.toml");
  require(kRobot.has_value());
  const std::string_view text(reinterpret_cast<const char*>(data), size);
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
