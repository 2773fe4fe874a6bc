// The course of a run: which phase follows which, and by what. Pure: no robot, no clock, no log.
// Layer: runtime.  Thread: the loop's.
#pragma once

#include <algorithm>
#include <cstdint>

#include "base/archive.hpp"
#include "base/realtime.hpp"
#include "hal/run_phase.hpp"
#include "hal/stop_category.hpp"
#include "runtime/cycle_config.hpp"

namespace tandem::runtime {

using hal::RunPhase;
using hal::to_string;

/// What changes a run's phase.
enum class RunEvent : std::uint8_t {
  kEnabled,      ///< every axis follows its command: bring-up or a reset is done
  kSettled,      ///< every joint has been held for settle_cycles
  kFinished,     ///< the controllers are done, or their time is over
  kStop,         ///< a stop of category "hold", 1 or 0
  kRetreat,      ///< a stop of category 2, and a controller can lead the robot to a safe posture
  kReset,        ///< asked for, and a drive has to be enabled again
  kResetFailed,  ///< a cause is still there, or it took too long
  kStart,        ///< controllers are started by a deliberate act
  kEnd,          ///< asked for, or there is nothing left to wait for
  kDisabled,     ///< every drive is, or it took too long
};
inline constexpr RunEvent kRunEvents[] = {
    RunEvent::kEnabled, RunEvent::kSettled, RunEvent::kFinished,    RunEvent::kStop,
    RunEvent::kRetreat, RunEvent::kReset,   RunEvent::kResetFailed, RunEvent::kStart,
    RunEvent::kEnd,     RunEvent::kDisabled};

/// What an event's outcome depends on besides the phase.
struct RunGuards {
  bool settles = false;  ///< the robot has to settle before controllers run
  bool waits = false;    ///< after a stop the run waits: for a reset, or to be ended
  /// Controllers that were active before a reset, or whose joints are to be homed, wait to be
  /// started.
  bool holds_back = false;
};

/// The phase after `event`; `phase` itself where the event has no meaning there.
[[nodiscard]] RunPhase next_phase(RunPhase phase, RunEvent event,
                                  RunGuards guards) noexcept TANDEM_RT;

/// Where a run stands, since when, and the hardest stop that is latched.
class RunMachine {
 public:
  explicit RunMachine(const CycleConfig& config) : config_(config) {}

  [[nodiscard]] RunPhase phase() const noexcept TANDEM_RT { return phase_; }
  [[nodiscard]] bool in(RunPhase phase) const noexcept TANDEM_RT { return phase_ == phase; }
  /// kRunning or kRetreating.
  [[nodiscard]] bool controllers_run() const noexcept TANDEM_RT {
    return in(RunPhase::kRunning) || in(RunPhase::kRetreating);
  }
  /// The hardest category that is latched; kWarn: none.
  [[nodiscard]] hal::StopCategory latched() const noexcept TANDEM_RT { return latched_; }

  /// The phase's time is over in `cycle`: the robot has settled, the controllers have run for long
  /// enough, or bring-up, reset, retreat or shut-down take too long. The time of a robot that holds
  /// its joints until the run ends goes on.
  [[nodiscard]] bool time_is_over(std::uint64_t cycle) const noexcept TANDEM_RT;

  /// @param holds_back  RunGuards::holds_back, for kEnabled
  /// @return whether the phase is another one now
  bool on(RunEvent event, std::uint64_t cycle, bool holds_back = false) noexcept TANDEM_RT;

  /// Latches a stop, whose RunEvent::kStop is to follow. @return false: it stops nothing, as a
  /// warning, and what is no harder than category 2 while the robot retreats.
  bool latch(hal::StopCategory category) noexcept TANDEM_RT;
  /// A reset has cleared every fault.
  void unlatch() noexcept TANDEM_RT { latched_ = hal::StopCategory::kWarn; }

  void archive(Archive& ar) { ar(phase_, latched_, began_, spent_); }

 private:
  CycleConfig config_;
  RunPhase phase_ = RunPhase::kBringUp;
  hal::StopCategory latched_ = hal::StopCategory::kWarn;
  std::uint64_t began_ = 0;  // cycle of the phase's begin
  std::uint64_t spent_ = 0;  // of running_cycles, in earlier phases kRunning
};

}  // namespace tandem::runtime
