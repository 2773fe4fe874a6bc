// How a joint without an absolute encoder learns where it is: what is known of it.
// Layer: hal.  Thread: plain data.
#pragma once

#include <cstdint>

namespace tandem::hal {

enum class HomingState : std::uint8_t {
  kNone = 0,  ///< the joint has no homing: its encoder is absolute
  kNotHomed,  ///< its position is not known; after a power loss again
  kHoming,    ///< its drive looks for it
  kHomed,     ///< its position is known, until the drive's power is lost
};
/// For JSON and tables: "none", "not homed", "under way", "homed".
[[nodiscard]] const char* to_string(HomingState state) noexcept;

/// Why the last homing did not find the joint's place.
enum class HomingError : std::uint8_t {
  kNone = 0,
  kDrive,        ///< the drive says so: bit 13 of its statusword
  kTimeout,      ///< its time was over
  kMode,         ///< the drive did not go into the homing mode
  kStopped,      ///< on request
  kInterrupted,  ///< by a fault, a stop of the robot, or a drive that was switched off
};
/// "the drive reports a homing error"; empty for kNone.
[[nodiscard]] const char* to_string(HomingError error) noexcept;

/// What to do about it: "give homing.method …"; empty for kNone.
[[nodiscard]] const char* next_step(HomingError error) noexcept;

struct Homing {
  HomingState state = HomingState::kNone;
  HomingError error = HomingError::kNone;  ///< of the last one
};

}  // namespace tandem::hal
