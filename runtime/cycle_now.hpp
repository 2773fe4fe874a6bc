// The parts that a cycle joins, and what they share: time, state, phase, limits, faults and log.
// Layer: runtime.  Thread: made non-RT; the loop's, but for faults and progress.
#pragma once

#include "base/archive.hpp"
#include "base/realtime.hpp"
#include "base/result.hpp"
#include "estimation/estimator.hpp"
#include "hal/backend.hpp"
#include "hal/command_limits.hpp"
#include "hal/config/robot_config.hpp"
#include "hal/cycle_observer.hpp"
#include "hal/outside.hpp"
#include "hal/truth.hpp"
#include "log/recorder.hpp"
#include "rt/cyclic_loop.hpp"
#include "runtime/controller_host.hpp"
#include "runtime/cycle_config.hpp"
#include "runtime/cycle_log.hpp"
#include "runtime/fault.hpp"
#include "runtime/fault_watch.hpp"
#include "runtime/inbox.hpp"
#include "runtime/owner_controller.hpp"
#include "runtime/progress.hpp"
#include "runtime/run_identity.hpp"
#include "runtime/run_machine.hpp"
#include "runtime/snapshot_port.hpp"

namespace tandem::runtime {

class Events;
class TimeMachine;

/// The parts that a cycle joins. All outlive it.
struct CycleParts {
  const hal::RobotConfig& robot;
  hal::Backend& backend;
  ControllerHost& controllers;
  rt::Clock& clock;
  log::Recorder* recorder = nullptr;           ///< null: nothing is logged. Not started yet.
  const hal::TruthImage* truth = nullptr;      ///< the simulation's, filled by backend.read()
  hal::CycleObserver* observer = nullptr;      ///< null: nobody watches
  RemoteCommandParts owner = {};               ///< for one in another process
  estimation::Estimator* estimator = nullptr;  ///< null: nothing is estimated
  SnapshotPort* snapshots = nullptr;           ///< null: nobody wants any while it runs
  RunIdentity identity = {};                   ///< a snapshot of another one is refused
  TimeMachine* time_machine = nullptr;         ///< null: time does not go back
  Events* events = nullptr;                    ///< null: there are none
};

/// What the parts of RobotCycle know of this cycle. RobotCycle fills it; they read it, note faults
/// and log events.
struct CycleNow : CycleParts {
  /// Adds the recorder's channels and starts it.
  CycleNow(const CycleParts& parts, const CycleConfig& how)
      : CycleParts(parts),
        config(how),
        inbox(how.loop),
        loop(how.loop, clock, &inbox.clock()),
        state(robot.shape()),
        run(how),
        limits(hal::robot_of(robot), how.loop.period_ns),
        watch(robot, backend, how.lost_after_cycles, how.fall),
        log(name_controllers(parts), state, hal::CommandImage(robot.shape()), truth, estimate()) {
    progress.total_cycles = how.running_cycles;
    controllers.time_by(clock);
    controllers.heed(outside);
    backend.heed(outside);
  }
  /// Null where nothing is estimated.
  [[nodiscard]] const hal::EstimateImage* estimate() const noexcept TANDEM_RT {
    return estimator == nullptr ? nullptr : &estimator->image();
  }
  void event(log::EventKind kind, std::int32_t joint = -1, std::uint32_t code = 0,
             std::int32_t controller = -1, const hal::LimitMet& met = {}) noexcept TANDEM_RT {
    log.event(time, kind, joint, code, 0.0F, false, controller, met);
  }
  void archive(Archive& ar) {
    ar(loop, time, read_code, run, limits, state, watch, faults);
    if (estimator != nullptr) ar(*estimator);
  }

  /// @return the recorder, which knows the controllers' names now
  static log::Recorder* name_controllers(const CycleParts& parts) {
    if (parts.recorder != nullptr) {
      parts.recorder->name_controllers(
          [names = parts.controllers.names()](std::size_t id) { return names->name(id); });
    }
    return parts.recorder;
  }

  const CycleConfig config;
  Inbox inbox;
  hal::Outside outside;
  rt::CyclicLoop loop;
  rt::Tick tick;
  hal::CycleTime time;
  Code read_code = Code::kOk;  ///< of the backend's read()
  hal::StateImage state;
  RunMachine run;
  hal::CommandLimits limits;
  FaultWatch watch;
  FaultLog faults;
  CycleLog log;
  Progress progress;
};

}  // namespace tandem::runtime
