// Where a run stands between power-on and power-off.
// Layer: hal.  Thread: any.
#pragma once

#include <cstdint>

namespace tandem::hal {

/// The numbers are those of the topics and the link between processes: new ones come behind.
enum class RunPhase : std::uint8_t {
  kBringUp,    ///< the backend configures and enables its drives
  kSettling,   ///< every joint is held where it was enabled, until the robot has been let down
  kRunning,    ///< controllers run
  kFaulted,    ///< a stop of category "hold", 1 or 0 is latched
  kResetting,  ///< faults are cleared, and every joint enabled where it is
  kShutDown,   ///< the drives stop and are disabled
  kDone,
  kHeld,        ///< after a reset, or until joints are homed: controllers wait to start
  kRetreating,  ///< a stop of category 2: controllers bring the robot to a safe posture
};

/// The run is over, or about to be.
[[nodiscard]] constexpr bool ends(RunPhase phase) noexcept {
  return phase == RunPhase::kShutDown || phase == RunPhase::kDone;
}

[[nodiscard]] constexpr const char* to_string(RunPhase phase) noexcept {
  switch (phase) {
    case RunPhase::kBringUp: return "bring-up";
    case RunPhase::kSettling: return "settling";
    case RunPhase::kRunning: return "running";
    case RunPhase::kFaulted: return "faulted";
    case RunPhase::kResetting: return "resetting";
    case RunPhase::kHeld: return "held";
    case RunPhase::kRetreating: return "retreating";
    case RunPhase::kShutDown: return "shut-down";
    case RunPhase::kDone: return "done";
  }
  return "?";
}

}  // namespace tandem::hal
