// SDO abort codes (CiA 301).
// Layer: canopen.  Thread: any.
#pragma once

#include <cstdint>

namespace tandem::canopen {

enum class AbortCode : std::uint32_t {
  kNone = 0,
  kToggle = 0x05030000,
  kTimeout = 0x05040000,
  kBadCommand = 0x05040001,
  kOutOfMemory = 0x05040005,
  kUnsupportedAccess = 0x06010000,
  kWriteOnly = 0x06010001,
  kReadOnly = 0x06010002,
  kNoObject = 0x06020000,
  kNotMappable = 0x06040041,
  kMappingTooLong = 0x06040042,
  kIncompatibleParameter = 0x06040043,
  kIncompatibleDevice = 0x06040047,
  kHardware = 0x06060000,
  kLength = 0x06070010,
  kTooLong = 0x06070012,
  kTooShort = 0x06070013,
  kNoSubIndex = 0x06090011,
  kRange = 0x06090030,
  kTooHigh = 0x06090031,
  kTooLow = 0x06090032,
  kMaxBelowMin = 0x06090036,
  kGeneral = 0x08000000,
  kCannotStore = 0x08000020,
  kLocalControl = 0x08000021,
  kDeviceState = 0x08000022,
  kNoData = 0x08000024,
};

/// The code in words ("object does not exist"); "unknown abort code" for any other number.
[[nodiscard]] const char* to_string(AbortCode code) noexcept;

}  // namespace tandem::canopen
