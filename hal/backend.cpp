// The texts of fault causes that every backend shares.
#include "hal/backend.hpp"

#include <cstdio>

namespace tandem::hal {

std::string Backend::fault_text(FaultCause cause, std::uint32_t code) const {
  switch (cause) {
    case FaultCause::kDrive: break;
    case FaultCause::kEmergencyInput: return "the emergency stop input of its board is active";
    case FaultCause::kNotEnabled: return "the drive was not enabled in time";
    case FaultCause::kLeftEnabled: return "the drive was disabled by itself";
    case FaultCause::kBoardSilent: return "its board sends no feedback any more";
    case FaultCause::kHeartbeatLost: return "its board's heartbeat was lost";
    case FaultCause::kGuardingLost: return "its board does not answer node guarding any more";
    case FaultCause::kBoardRebooted: return "its board booted again by itself";
    case FaultCause::kBoardStopped: return "its board left operation by itself";
    case FaultCause::kBoardRefused: return "its board cannot be configured";
    case FaultCause::kTwoBoards: return "two boards answer under its board's id";
    case FaultCause::kNotFollowing:
      return "it does not follow its command: is the joint blocked, does its drive get its "
             "commands?";
    case FaultCause::kIgnoresStop:
      return "its drive does not obey the stop, and may still be enabled: cut its power (emergency "
             "stop, STO)";
    case FaultCause::kTooFast:
      return "it moves faster than its maximum velocity, and its drive does not stop it";
    case FaultCause::kTooStrong:
      return "its torque is beyond its maximum, and its drive does not stop it";
    case FaultCause::kTooPowerful:
      return "its power is beyond that of its limits, and its drive does not stop it";
    case FaultCause::kSwings:
      return "it swings about its reference, and its drive does not stop it";
  }
  char text[48];
  std::snprintf(text, sizeof text, "the drive reports error 0x%04X", code);
  return text;
}

}  // namespace tandem::hal
