// A run in this process as one object, for tools, tests and programs of one's own.
// Layer: runtime/run.  Thread: one at a time; step() is what the loop's thread calls.
#pragma once

#include <expected>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "internal_model/parallel_robot.hpp"
#include "log/recorder.hpp"
#include "rt/clock.hpp"
#include "runtime/robot_cycle.hpp"
#include "runtime/run/composition.hpp"

namespace tandem::runtime {

/// What a caller adds to a run. All outlive it.
struct RunParts {
  log::Recorder* recorder = nullptr;        ///< not started yet; null: nothing is logged
  hal::CycleObserver* observer = nullptr;   ///< null: nobody watches
  hal::RemoteCommandPort* owner = nullptr;  ///< null: nobody owns the robot from afar
  rt::Clock* clock = nullptr;               ///< null: the computer's
  TimeMachine* time_machine = nullptr;      ///< null: time does not go back
};

/// A robot with its controllers, from an experiment's file to the last cycle:
///
///     auto run = runtime::Run::open("squat.toml");
///     if (!run) return tell(run.error());
///     while ((*run)->step()) plot((*run)->state().position_rad());
///
/// It runs as `tandem run` does, to the same bits: free of the wall clock unless the experiment's
/// [clock] says a rate. Nothing is logged, printed or opened to others but what the caller adds.
class Run {
 public:
  /// Makes the backend of what is composed, or puts another one in its place.
  using Connect = std::function<Diagnostics(Composition&)>;

  /// @param overrides  what the caller wants otherwise; kernels that are missing are built,
  /// silently
  /// @param connect    empty: the robot is the simulation in this process
  /// Errors: compose()'s; connect()'s; a robot elsewhere that nobody connects.
  [[nodiscard]] static std::expected<std::unique_ptr<Run>, Diagnostics> open(
      const std::string& experiment, const Overrides& overrides = {}, const RunParts& parts = {},
      const Connect& connect = {});

  /// The run of what is composed and connected, which outlives it. [parallel] has a thread of its
  /// own from now on.
  Run(Composition& c, const Overrides& overrides, const RunParts& parts);
  ~Run();
  Run(const Run&) = delete;
  Run& operator=(const Run&) = delete;

  /// One cycle. False after the last one.
  bool step() noexcept { return cycle_->step(); }

  [[nodiscard]] const Experiment& experiment() const noexcept { return c_->experiment; }
  [[nodiscard]] const Diagnostics& warnings() const noexcept { return c_->warnings; }
  [[nodiscard]] const tandem_kernels& kernels() const noexcept { return *c_->kernels.get(); }
  [[nodiscard]] const hal::StateImage& state() const noexcept { return cycle_->state(); }
  [[nodiscard]] const hal::CommandImage& command() const noexcept { return cycle_->command(); }
  /// What the plant has, beside what is measured. @pre is_simulated()
  [[nodiscard]] const hal::TruthImage& truth() const noexcept { return c_->sim->truth(); }
  /// @pre the experiment has [estimation]
  [[nodiscard]] const hal::EstimateImage& estimate() const noexcept {
    return c_->estimator->image();
  }
  /// Whether the robot is the simulation in this process.
  [[nodiscard]] bool is_simulated() const noexcept { return c_->sim != nullptr; }
  /// @pre is_simulated()
  [[nodiscard]] sim::SimRobot& robot() noexcept { return *c_->sim; }
  /// More of them may be added before the first cycle.
  [[nodiscard]] ControllerHost& controllers() noexcept { return *c_->controllers; }
  /// The second robot, whose figures are there after its finish(); null without [parallel].
  [[nodiscard]] internal_model::ParallelRobot* parallel() noexcept {
    return parallel_ ? &*parallel_ : nullptr;
  }
  /// What will happen, asked from another thread than step()'s; null: there is no model to ask.
  [[nodiscard]] internal_model::PredictionService* predictions() noexcept {
    return c_->predictor.get();
  }
  /// What the experiment expects of it; null: nothing.
  [[nodiscard]] const Expectations* expectations() const noexcept { return c_->expectations.get(); }
  /// What the experiment lets happen; null: nothing, or at known times alone. Requests among it are
  /// refused unless the caller says who carries them out, before the first cycle.
  [[nodiscard]] Events* events() noexcept { return c_->events.get(); }
  /// Why save() and restore() of the cycle are not the whole of it; empty: they are.
  [[nodiscard]] std::string why_no_past() const { return runtime::why_no_past(*c_); }
  /// Faults, statistics, requests, save() and restore().
  [[nodiscard]] RobotCycle& cycle() noexcept { return *cycle_; }
  [[nodiscard]] const RobotCycle& cycle() const noexcept { return *cycle_; }

 private:
  std::unique_ptr<Composition> own_;  // open()'s
  Composition* c_;
  rt::WallClock clock_;
  hal::CycleFanOut observers_;
  std::optional<internal_model::ParallelRobot> parallel_;
  std::optional<RobotCycle> cycle_;
};

}  // namespace tandem::runtime
