#include "hal/homing.hpp"

namespace tandem::hal {

const char* to_string(HomingState state) noexcept {
  switch (state) {
    case HomingState::kNone: return "none";
    case HomingState::kNotHomed: return "not homed";
    case HomingState::kHoming: return "under way";
    case HomingState::kHomed: return "homed";
  }
  return "none";
}

const char* to_string(HomingError error) noexcept {
  switch (error) {
    case HomingError::kNone: return "";
    case HomingError::kDrive: return "the drive reports a homing error (statusword bit 13)";
    case HomingError::kTimeout: return "it did not end within its timeout_s";
    case HomingError::kMode: return "the drive did not go into the homing mode (6)";
    case HomingError::kStopped: return "it was stopped on request";
    case HomingError::kInterrupted: return "a fault or a stop interrupted it";
  }
  return "";
}

const char* next_step(HomingError error) noexcept {
  switch (error) {
    case HomingError::kNone: return "";
    case HomingError::kDrive:
      return "give homing.method a number that the drive has, and look at its switches";
    case HomingError::kTimeout:
      return "look at the switch, or raise homing.timeout_s or homing.speed_rad_s";
    case HomingError::kMode: return "look in the drive's manual when it takes mode 6";
    case HomingError::kStopped:
    case HomingError::kInterrupted: return "home it again";
  }
  return "";
}

}  // namespace tandem::hal
