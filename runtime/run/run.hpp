// A run in this process as one object, for tools, tests and programs of one's own.
// Layer: runtime/run.  Thread: one at a time; step() is what the loop's thread calls.
#pragma once

#include <expected>
#include <memory>
#include <optional>
#include <string>

#include "log/recorder.hpp"
#include "rt/clock.hpp"
#include "runtime/robot_cycle.hpp"
#include "runtime/run/composition.hpp"

namespace tandem::runtime {

/// A simulated robot with its controllers, from an experiment's file to the last cycle:
///
///     auto run = runtime::Run::open("squat.toml");
///     if (!run) return tell(run.error());
///     while ((*run)->step()) plot((*run)->state().position_rad());
///
/// It runs as `tandem run` does, to the same bits: free of the wall clock unless the experiment's
/// [clock] says a rate. Nothing is logged, printed or opened to others but what the caller adds.
class Run {
 public:
  /// @param overrides  what the caller wants otherwise; kernels that are missing are built,
  /// silently
  ///                   where `build_kernels` is empty
  /// @param recorder   not started yet, outlives the run; null: nothing is logged
  /// Errors: compose()'s; a robot that is not simulated in this process; [parallel], which needs a
  /// second loop.
  [[nodiscard]] static std::expected<std::unique_ptr<Run>, Diagnostics> open(
      const std::string& experiment, Overrides overrides = {}, log::Recorder* recorder = nullptr);

  /// One cycle. False after the last one.
  bool step() noexcept { return cycle_->step(); }

  [[nodiscard]] const Experiment& experiment() const noexcept { return parts_->experiment; }
  [[nodiscard]] const Diagnostics& warnings() const noexcept { return parts_->warnings; }
  [[nodiscard]] const hal::StateImage& state() const noexcept { return cycle_->state(); }
  [[nodiscard]] const hal::CommandImage& command() const noexcept { return cycle_->command(); }
  /// What the plant has, beside what is measured.
  [[nodiscard]] const hal::TruthImage& truth() const noexcept { return parts_->sim->truth(); }
  [[nodiscard]] sim::SimRobot& robot() noexcept { return *parts_->sim; }
  [[nodiscard]] ControllerHost& controllers() noexcept { return *parts_->controllers; }
  /// Faults, statistics, requests, save() and restore().
  [[nodiscard]] RobotCycle& cycle() noexcept { return *cycle_; }
  [[nodiscard]] const RobotCycle& cycle() const noexcept { return *cycle_; }

 private:
  Run() = default;

  std::unique_ptr<Composition> parts_ = std::make_unique<Composition>();
  rt::WallClock clock_;
  std::optional<RobotCycle> cycle_;
};

}  // namespace tandem::runtime
