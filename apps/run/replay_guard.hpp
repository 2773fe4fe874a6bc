// The end of a replay whose controller crashes or does not come back.
// Layer: apps/run.  Thread: the replay's; the watchdog's own.
#pragma once

#include <string>

#include "runtime/cycle_watchdog.hpp"
#include "runtime/robot_cycle.hpp"
#include "runtime/run/composition.hpp"

namespace tandem::apps {

/// Watches a replay from its first cycle on. A cycle that crashes, or takes longer than [faults]
/// watchdog_s (5 s), ends the process with status 2: standard error and the command's JSON name the
/// controller and, of a crash, function, file and line.
class ReplayGuard {
 public:
  /// Call it on the replay's thread, before the first cycle. Cycle and composition outlive it.
  /// @param draft  a file that is removed when the process ends here; empty: none
  /// @param json   write_failure()'s
  ReplayGuard(runtime::RobotCycle& cycle, const runtime::Composition& composition,
              std::string draft, std::string json);

 private:
  [[noreturn]] void end(bool at_work) const;

  const runtime::RobotCycle* cycle_;
  const runtime::ControllerHost* controllers_;
  std::string draft_, json_;
  double limit_s_;
  runtime::CycleWatchdog watchdog_;  // last: its thread uses the others
};

}  // namespace tandem::apps
