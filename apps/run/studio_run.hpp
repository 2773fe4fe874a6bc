// The studio of a run: what it shows of it, and how it asks it.
// Layer: apps/run.  Thread: main; open() any.
#pragma once

#include <memory>
#include <mutex>
#include <string>

#include "apps/command_line/command_line.hpp"
#include "apps/control/control_registry.hpp"
#include "apps/control/turns.hpp"
#include "apps/run/connection.hpp"
#include "apps/run/foxglove_run.hpp"
#include "base/result.hpp"
#include "hal/cycle_observer.hpp"
#include "hal/sim/plant_changes.hpp"
#include "runtime/robot_cycle.hpp"
#include "studio/studio.hpp"

namespace tandem::apps {

/// What a client of the studio may ask for: reading and stopping everybody may; what changes the
/// run needs the run's token, and what changes a joint control of the joints as well.
[[nodiscard]] ControlRegistry::Gate studio_gate(const studio::Rights& rights);

/// The robot on the ground that is simulated. @param plant  null: the ground is its files'
[[nodiscard]] hal::RobotConfig on_its_ground(hal::RobotConfig robot,
                                             const sim::PlantChanges* plant);

/// Opens the studio when the run starts, or when somebody asks for it: the command `studio.open`.
/// Once open it stays until the run is over.
class StudioRun {
 public:
  /// @param node  this process in ROS 2's graph: "tandem_run"
  /// @pre the composition outlives this; before open() it is connected
  StudioRun(const WiredComposition& composition, std::string node)
      : composition_(&composition), node_(std::move(node)) {}
  ~StudioRun();
  StudioRun(const StudioRun&) = delete;
  StudioRun& operator=(const StudioRun&) = delete;

  /// CycleParts::observer, whether or not it is open
  [[nodiscard]] hal::CycleObserver& tap() { return tap_; }
  /// Listens; after start() clients are answered. Takes all the memory of it. Any thread but the
  /// loop's. @return the address; that of before when it is open already
  /// Errors: studio::Studio::open()'s, FoxgloveRun::open()'s; no memory; the run is over.
  [[nodiscard]] Result<std::string> open(const StudioOptions& options);
  /// Adds `studio.open`; from now on clients are answered. Before the first cycle.
  /// @param commands  all others are there; outlives this. Its tell() is used up
  /// @param parallel  the second robot; null: there is none
  /// @param recorder  for /metrics; null: nothing is logged. Outlives finish()
  void start(runtime::RobotCycle& cycle, ControlRegistry& commands, hal::ParallelSource* parallel,
             const log::Recorder* recorder);
  /// When there are no more cycles.
  void finish(const std::string& how, const std::string& log);

 private:
  class Happenings;
  struct Parts {
    std::unique_ptr<FoxgloveRun> foxglove;  // the studio's thread uses it
    std::unique_ptr<studio::Studio> studio;
    std::unique_ptr<ControlTurns> turns;
  };
  [[nodiscard]] Result<Parts> make(const StudioOptions& options) const;
  void begin(Parts& parts);
  [[nodiscard]] Result<Json> asked_to_open(const Json& request);
  [[nodiscard]] bool is_open();

  const WiredComposition* composition_;
  std::string node_;
  runtime::RobotCycle* cycle_ = nullptr;
  ControlRegistry* commands_ = nullptr;
  hal::ParallelSource* parallel_ = nullptr;
  const log::Recorder* recorder_ = nullptr;
  std::shared_ptr<Happenings> happenings_;
  hal::LateObserver tap_;
  std::mutex mutex_;  // of what follows
  Parts open_;
  bool over_ = false;
};

}  // namespace tandem::apps
