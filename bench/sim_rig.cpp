#include "bench/sim_rig.hpp"

namespace tandem::bench {

std::unique_ptr<runtime::RobotCycle> SimRig::cycle(std::size_t trace_cycles,
                                                   log::Recorder* recorder) {
  const runtime::Experiment& e = run->experiment;
  const runtime::CycleParts parts{e.robot, *robot, *run->host, clock, recorder, &robot->truth()};
  return std::make_unique<runtime::RobotCycle>(
      parts, runtime::CycleConfig{.loop = e.loop,
                                  .running_cycles = e.cycles(),
                                  .settle_cycles = e.settle_cycles(),
                                  .trace_cycles = trace_cycles});
}

Result<std::unique_ptr<SimRig>> make_sim_rig(const std::string& file, const std::string& library) {
  auto run = make_rig(file, library);
  if (!run) return std::unexpected(run.error());
  const runtime::Experiment& e = (*run)->experiment;
  auto robot = sim::SimRobot::create(e.robot, (*run)->kernels.get(), e.sim_robot_config());
  if (!robot) return std::unexpected(robot.error());
  auto rig = std::make_unique<SimRig>();
  rig->run = std::move(*run);
  rig->robot = std::move(*robot);
  return rig;
}

}  // namespace tandem::bench
