// What makes a run go back in time: its checkpoints, and what conditions mean to it.
// Layer: apps/run.  Thread: made main's; the conditions are read on the serving thread.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "apps/command_line/command_line.hpp"
#include "apps/control/clock_commands.hpp"
#include "runtime/logged_state.hpp"
#include "runtime/run/composition.hpp"
#include "runtime/run/trunk.hpp"
#include "runtime/time_machine.hpp"

namespace tandem::apps {

/// One run's.
class Past {
 public:
  Past(const runtime::Composition& composition, const RunOptions& options);

  /// Errors: checkpoints are wanted of a run that cannot go back.
  [[nodiscard]] Status check(const RunOptions& options) const;
  /// Null: the run cannot go back. Outlives the cycles.
  [[nodiscard]] runtime::TimeMachine* machine() noexcept { return machine_.get(); }
  /// Errors: the run is to go on from a log that says nothing of that moment.
  [[nodiscard]] Status read_beginning(const RunOptions& options);
  /// The time at which the run begins: not 0 where it goes on from another one.
  [[nodiscard]] double begins_s() const noexcept { return begins_s_; }
  /// Where the run goes on from; of a run from its beginning: nothing.
  [[nodiscard]] log::Branch branch() const { return begins_ ? begins_->branch : log::Branch{}; }
  /// Before the first cycle: states go to the log, and the run goes to where it begins.
  /// @return a line about it; empty: it begins as ever. Errors: TimeMachine::begin()'s
  [[nodiscard]] Result<std::string> begin(runtime::RobotCycle& cycle, log::Recorder* recorder,
                                          const RunOptions& options);
  /// After the last cycle, before the log is closed.
  void finish();
  /// For add_clock_commands(). The cycle outlives what it is given to.
  [[nodiscard]] RunPast of(runtime::RobotCycle& cycle);

 private:
  [[nodiscard]] Status write_trunk(const RunOptions& options);
  [[nodiscard]] Status begin_in(runtime::RobotCycle& cycle, const RunOptions& options);
  [[nodiscard]] bool boards_are_elsewhere() const;

  const runtime::Composition& c_;
  std::string why_not_;
  std::unique_ptr<runtime::TimeMachine> machine_;
  std::optional<runtime::Beginning> begins_;
  std::unique_ptr<runtime::TrunkFile> trunk_;  // null: none is written
  double begins_s_ = 0.0;
};

}  // namespace tandem::apps
