// What makes a run go back in time: its checkpoints, and what conditions mean to it.
// Layer: apps/run.  Thread: made main's; the conditions are read on the serving thread.
#pragma once

#include <memory>
#include <string>

#include "apps/command_line/command_line.hpp"
#include "apps/control/clock_commands.hpp"
#include "runtime/run/composition.hpp"
#include "runtime/time_machine.hpp"

namespace tandem::apps {

/// One run's.
class Past {
 public:
  /// @param served  another process may own the robot
  Past(const runtime::Composition& composition, const RunOptions& options, bool served);

  /// Errors: checkpoints are wanted of a run that cannot go back.
  [[nodiscard]] Status check(const RunOptions& options) const;
  /// Null: the run cannot go back. Outlives the cycles.
  [[nodiscard]] runtime::TimeMachine* machine() noexcept { return machine_.get(); }
  /// For add_clock_commands(). The cycle outlives what it is given to.
  [[nodiscard]] RunPast of(runtime::RobotCycle& cycle);

 private:
  const runtime::Composition& c_;
  std::string why_not_;
  std::unique_ptr<runtime::TimeMachine> machine_;
};

}  // namespace tandem::apps
