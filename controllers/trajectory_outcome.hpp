// How the last trajectory of a trajectory_follower went: what its signals say, for whoever asked
// for the trajectory.
// Layer: controllers.  Thread: any; plain data.
#pragma once

#include <cstdint>

namespace tandem {

/// The signal "outcome".
enum class TrajectoryOutcome : std::uint8_t {
  kUnderWay,
  kReached,  ///< its end, and there every tolerance
  kHolds,    ///< it had no way-points, and the references have come to rest
  kOffPath,  ///< a joint left its path tolerance: the references come to rest
  kOffGoal,  ///< a joint did not keep a tolerance of the goal in time: the joints stay there
};

/// Names of the signals. Those of the joint have a meaning for kOffPath and kOffGoal.
struct TrajectorySignals {
  static constexpr const char* kCycle = "trajectory_cycle";  ///< in which it arrived; -1: none
  static constexpr const char* kOutcome = "outcome";
  static constexpr const char* kJoint = "outcome_joint";          ///< number among the controller's
  static constexpr const char* kError = "outcome_error";          ///< measured less reference
  static constexpr const char* kTolerance = "outcome_tolerance";  ///< that this is beyond
  static constexpr const char* kOfVelocity = "outcome_of_velocity";  ///< 1: both are velocities
  static constexpr const char* kTime = "outcome_time";  ///< after the trajectory's beginning [s]
};

}  // namespace tandem
