// The studio of a run: what it shows of it, and how it asks it.
// Layer: apps/run.  Thread: main.
#pragma once

#include <memory>
#include <string>

#include "apps/command_line/command_line.hpp"
#include "apps/control/control_registry.hpp"
#include "apps/control/turns.hpp"
#include "apps/run/connection.hpp"
#include "apps/run/foxglove_run.hpp"
#include "base/result.hpp"
#include "runtime/robot_cycle.hpp"
#include "studio/studio.hpp"

namespace tandem::apps {

/// What a client of the studio may ask for: reading and stopping everybody may; what changes the
/// run needs the run's token, and what changes a joint control of the joints as well.
[[nodiscard]] ControlRegistry::Gate studio_gate(const studio::Rights& rights);

class StudioRun {
 public:
  /// Listens; null when --studio is not given.
  /// @param node  this process in ROS 2's graph: "tandem_run"
  /// @pre the composition is connected and outlives this
  /// Errors: studio::Studio::open()'s, FoxgloveRun::open()'s
  [[nodiscard]] static Result<std::unique_ptr<StudioRun>> open(const WiredComposition& composition,
                                                               const StudioOptions& options,
                                                               const std::string& node);
  ~StudioRun();
  StudioRun(const StudioRun&) = delete;
  StudioRun& operator=(const StudioRun&) = delete;

  /// CycleParts::observer
  [[nodiscard]] hal::CycleObserver& tap() { return studio_->tap(); }
  [[nodiscard]] std::string address() const { return studio_->address(); }
  /// From now on clients are answered. Before the first cycle.
  /// @param commands  all of them are there; outlives this. Its tell() is used up
  /// @param parallel  the second robot; null: there is none
  void start(runtime::RobotCycle& cycle, ControlRegistry& commands, hal::ParallelSource* parallel);
  /// When there are no more cycles.
  void finish(const std::string& how, const std::string& log);

 private:
  class Happenings;
  StudioRun(std::unique_ptr<studio::Studio> studio, std::unique_ptr<FoxgloveRun> foxglove);

  std::unique_ptr<FoxgloveRun> foxglove_;  // the studio's thread uses it
  std::unique_ptr<studio::Studio> studio_;
  std::shared_ptr<Happenings> happenings_;
  std::unique_ptr<ControlTurns> turns_;
};

}  // namespace tandem::apps
