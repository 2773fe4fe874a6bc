// Why a joint is in fault, and how the robot is stopped: the categories of IEC 60204-1, and two
// that stop less.
// Layer: hal.  Thread: any.
#pragma once

#include <cstdint>

namespace tandem::hal {

/// The lower, the harder: of two that are asked for, the lower one is carried out.
enum class StopCategory : std::uint8_t {
  kCategory0 = 0,  ///< the torque is taken away at once
  kCategory1 = 1,  ///< every axis is brought to rest, then its torque is taken away
  kHold = 2,       ///< every axis stays under control where it is
  kWarn = 3,       ///< nothing is stopped: it is told
};

/// Why a joint is in fault.
enum class FaultCause : std::uint8_t {
  kDrive,           ///< the drive itself: its error code tells
  kEmergencyInput,  ///< the emergency stop input of its board
  kNotEnabled,      ///< it was not enabled in time
  kLeftEnabled,     ///< it was disabled, and not by us
  kBoardSilent,     ///< no feedback of its board
  kHeartbeatLost,   ///< of its board
  kBoardRebooted,
  kBoardStopped,    ///< its board left NMT operational by itself
  kBoardRefused,    ///< its board cannot be configured
  kTwoBoards,       ///< two boards answer under its board's id
};

/// As the TOML has it: "category0".
[[nodiscard]] constexpr const char* to_string(StopCategory category) noexcept {
  switch (category) {
    case StopCategory::kCategory0: return "category0";
    case StopCategory::kCategory1: return "category1";
    case StopCategory::kHold: return "hold";
    case StopCategory::kWarn: return "warn";
  }
  return "?";
}

}  // namespace tandem::hal
