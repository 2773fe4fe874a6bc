// The texts of SDO abort codes and of CiA 402 error codes, for messages and logs.
#include "canopen/abort_code.hpp"
#include "canopen/objects.hpp"

namespace tandem::canopen {

const char* to_string(AbortCode code) noexcept {
  switch (code) {
    case AbortCode::kNone: return "no error";
    case AbortCode::kToggle: return "toggle bit not alternated";
    case AbortCode::kTimeout: return "SDO protocol timed out";
    case AbortCode::kBadCommand: return "SDO command specifier unknown or not valid";
    case AbortCode::kOutOfMemory: return "out of memory";
    case AbortCode::kUnsupportedAccess: return "unsupported access to an object";
    case AbortCode::kWriteOnly: return "attempt to read a write-only object";
    case AbortCode::kReadOnly: return "attempt to write a read-only object";
    case AbortCode::kNoObject: return "object does not exist";
    case AbortCode::kNotMappable: return "object cannot be mapped to the PDO";
    case AbortCode::kMappingTooLong: return "the mapped objects exceed the PDO's length";
    case AbortCode::kIncompatibleParameter: return "parameter incompatible";
    case AbortCode::kIncompatibleDevice: return "internal incompatibility in the device";
    case AbortCode::kHardware: return "access failed because of a hardware error";
    case AbortCode::kLength: return "length of the parameter does not match";
    case AbortCode::kTooLong: return "parameter too long";
    case AbortCode::kTooShort: return "parameter too short";
    case AbortCode::kNoSubIndex: return "sub-index does not exist";
    case AbortCode::kRange: return "value out of range";
    case AbortCode::kTooHigh: return "value too high";
    case AbortCode::kTooLow: return "value too low";
    case AbortCode::kMaxBelowMin: return "maximum is less than minimum";
    case AbortCode::kGeneral: return "general error";
    case AbortCode::kCannotStore: return "data cannot be transferred or stored";
    case AbortCode::kLocalControl: return "data cannot be stored because of local control";
    case AbortCode::kDeviceState: return "data cannot be stored in the present device state";
    case AbortCode::kNoData: return "no data available";
  }
  return "unknown abort code";
}

const char* to_string(ErrorCode code) noexcept {
  switch (code) {
    case ErrorCode::kNone: return "no error";
    case ErrorCode::kGeneric: return "generic error";
    case ErrorCode::kOverCurrent: return "over-current";
    case ErrorCode::kI2t: return "I2t overload";
    case ErrorCode::kVoltage: return "voltage";
    case ErrorCode::kDriveTemperature: return "over-temperature";
    case ErrorCode::kSoftware: return "device software";
    case ErrorCode::kParameter: return "parameter error";
    case ErrorCode::kPositionSensor: return "position sensor";
    case ErrorCode::kSensorMismatch: return "link and motor encoder contradict each other";
    case ErrorCode::kCommunicationOverrun: return "frames were lost";
    case ErrorCode::kHeartbeatLost: return "heartbeat lost";
    case ErrorCode::kBusOffRecovered: return "recovered from bus-off";
    case ErrorCode::kPdoTooShort: return "PDO too short";
    case ErrorCode::kPdoTooLong: return "PDO too long";
    case ErrorCode::kSyncLost: return "SYNC lost";
    case ErrorCode::kVelocityControl: return "velocity limit exceeded";
    case ErrorCode::kExcessTorque: return "torque limit exceeded";
    case ErrorCode::kFollowingError: return "following error";
    case ErrorCode::kPositionLimit: return "position limit exceeded";
    case ErrorCode::kCommandTimeout: return "command time-out";
    case ErrorCode::kEmergencyInput: return "emergency stop input active";
    case ErrorCode::kOscillation: return "the joint oscillates";
    case ErrorCode::kExcessPower: return "power limit exceeded";
  }
  return "";
}

}  // namespace tandem::canopen
