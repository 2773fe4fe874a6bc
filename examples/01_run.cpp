// 01: runs a simulated robot with its controllers and prints its first joint's path. From build/…:
//   bin/example_01_run ../../config/double_pendulum/trajectory.toml lib/models
#include <cstdio>
#include <cstdlib>

#include "controllers/plugin_loader.hpp"
#include "model/kernel_build.hpp"
#include "model/kernel_library.hpp"
#include "runtime/experiment.hpp"
#include "runtime/robot_cycle.hpp"

using namespace tandem;

template <class T>
T must(Result<T> result) {
  if (result) return std::move(*result);
  std::puts(result.error().to_string().c_str());
  std::exit(2);
}

int main(int argc, char** argv) {
  if (argc != 3) return 2;
  const runtime::Experiment e = runtime::read_experiment(argv[1]).value();
  const auto kernels = must(model::load_kernels(model::library_path(argv[2], e.robot.name)));
  const auto robot = must(sim::SimRobot::create(e.robot, kernels.get(), e.sim_robot_config()));
  runtime::ControllerHost controllers(e.robot, kernels.get(), e.loop.period_ns);
  for (const runtime::ControllerSpec& one : e.controllers) {
    auto plugin = must(load_controller(one.plugin, controller_folders()));
    if (!controllers.add(one.name, std::move(plugin), one.parameters)) return 2;
  }
  rt::WallClock clock;
  runtime::RobotCycle cycle(
      {e.robot, *robot, controllers, clock},
      {.loop = e.loop, .running_cycles = e.cycles(), .settle_cycles = e.settle_cycles()});
  while (cycle.step()) {
    if (cycle.state().cycle()[0] % 500 != 0) continue;
    std::printf("%5.1f s  %.3f rad\n", static_cast<double>(cycle.state().time_ns()[0]) * 1e-9,
                cycle.state().position_rad()[0]);
  }
  return cycle.faults().empty() ? 0 : 1;
}
