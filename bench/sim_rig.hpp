// A run of a simulated robot but its loop.
#pragma once

#include <memory>
#include <string>

#include "bench/rig.hpp"
#include "hal/sim/sim_robot.hpp"
#include "log/recorder.hpp"
#include "rt/clock.hpp"
#include "runtime/robot_cycle.hpp"

namespace tandem::bench {

struct SimRig {
  std::unique_ptr<Rig> run;
  std::unique_ptr<sim::SimRobot> robot;
  rt::WallClock clock;

  /// @param trace_cycles  of which the stages' times are kept
  /// @param recorder      of its log; may be null
  [[nodiscard]] std::unique_ptr<runtime::RobotCycle> cycle(std::size_t trace_cycles,
                                                           log::Recorder* recorder);
};

/// As make_rig().
[[nodiscard]] Result<std::unique_ptr<SimRig>> make_sim_rig(const std::string& experiment,
                                                           const std::string& library);

}  // namespace tandem::bench
