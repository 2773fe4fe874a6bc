// What is wrong, and how the robot is stopped: the categories of IEC 60204-1, and two that stop
// less.
// Layer: hal.  Thread: any.
#pragma once

#include <cstddef>
#include <cstdint>
#include <iterator>
#include <string>

namespace tandem::hal {

/// The lower, the harder: of two that are asked for, the lower one is carried out.
enum class StopCategory : std::uint8_t {
  kCategory0 = 0,  ///< the torque is taken away at once
  kCategory1 = 1,  ///< every axis is brought to rest, then its torque is taken away
  /// Controllers that can go on to a posture in which less happens, for a limited time, and then
  /// category 1: a protective stop (ISO 10218), which a standing robot survives.
  kCategory2 = 2,
  kHold = 3,  ///< every axis stays under control where it is
  kWarn = 4,  ///< nothing is stopped: it is reported
};

/// Whether it keeps drives from following commands at once. In category 2 they follow the retreat.
[[nodiscard]] constexpr bool stops_drives(StopCategory category) noexcept {
  return category != StopCategory::kCategory2 && category != StopCategory::kWarn;
}

/// What a fault's index counts. Drives and boards are of joints; a board is every joint of it.
enum class FaultStrikes : std::uint8_t { kDrive, kBoard, kJoint, kSensor, kController, kRobot };

/// What is wrong: a row each in hal/fault_causes.inc.
enum class FaultCause : std::uint8_t {
#define TANDEM_FAULT_CAUSE(name, strikes, category, event, number, brief, words, advice) name,
#include "hal/fault_causes.inc"
#undef TANDEM_FAULT_CAUSE
  kNone = 0xFF
};

/// What follows from a cause's row; log::event_of() is its event.
struct CauseRow {
  FaultStrikes strikes = FaultStrikes::kRobot;
  StopCategory category = StopCategory::kWarn;
  std::uint32_t number = 0;
  const char *brief = "", *words = "", *advice = "";
};
inline constexpr CauseRow kCauseRows[] = {
#define TANDEM_FAULT_CAUSE(name, strikes, category, event, number, brief, words, advice) \
  {FaultStrikes::strikes, StopCategory::category, number, brief, words, advice},
#include "hal/fault_causes.inc"
#undef TANDEM_FAULT_CAUSE
};

/// One without words for kNone, and for what a network or a snapshot may say.
[[nodiscard]] constexpr CauseRow row_of(FaultCause cause) noexcept {
  const auto row = static_cast<std::size_t>(cause);
  return row < std::size(kCauseRows) ? kCauseRows[row] : CauseRow{};
}
[[nodiscard]] constexpr bool strikes_joint(FaultStrikes strikes) noexcept {
  return strikes <= FaultStrikes::kJoint;
}
/// Its words and its advice.
[[nodiscard]] std::string sentence_of(FaultCause cause);
/// Whether the joint's board is in trouble, and not its drive alone.
[[nodiscard]] constexpr bool is_of_board(FaultCause cause) noexcept {
  return row_of(cause).strikes == FaultStrikes::kBoard;
}
/// Whether the joint's drive or board is in trouble.
[[nodiscard]] constexpr bool is_of_drive(FaultCause cause) noexcept {
  return row_of(cause).strikes == FaultStrikes::kDrive || is_of_board(cause);
}

/// As the TOML has it: "category0".
[[nodiscard]] constexpr const char* to_string(StopCategory category) noexcept {
  switch (category) {
    case StopCategory::kCategory0: return "category0";
    case StopCategory::kCategory1: return "category1";
    case StopCategory::kCategory2: return "category2";
    case StopCategory::kHold: return "hold";
    case StopCategory::kWarn: return "warn";
  }
  return "?";
}

}  // namespace tandem::hal
