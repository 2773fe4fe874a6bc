// What a run does once a stop was carried out, and once it was reset.
// Layer: runtime.  Thread: any.
#pragma once

#include <cstdint>

namespace tandem::runtime {

/// What comes after a stop of category 0 or 1. During bring-up it is always the end.
enum class AfterStop : std::uint8_t {
  kEnd,   ///< the run: the robot is shut down. After "hold" when the run's time is over.
  kWait,  ///< latched, for a reset or the request to end the run
};

/// What comes after a reset that has cleared every fault.
enum class AfterReset : std::uint8_t {
  kHold,      ///< every joint is held, until somebody starts controllers
  kContinue,  ///< controllers start again by themselves: for runs that nobody watches
};

}  // namespace tandem::runtime
