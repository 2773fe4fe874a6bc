// The faults that can be injected into an emulated robot, by name.
// Layer: hal.  Thread: any.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

namespace tandem::hal {

/// docs/simulation.md says what each does, docs/faults.md how it is noticed.
enum class FaultKind : std::uint8_t {
  kNone = 0,
  // frames, on their way between master and nodes
  kFrameDrop,
  kFrameDelay,      ///< comes some steps later
  kFrameDuplicate,  ///< comes twice
  kFrameCorrupt,    ///< bits flipped, or another length
  kFrameReorder,    ///< changes places with the next one that is selected
  // boards and sensor nodes
  kBoardKill,  ///< without power: silent, bridges open; with an end, boots again after it
  kBoardReset,
  kBoardIdentity,   ///< another product code
  kBoardRevision,   ///< another firmware revision
  kBoardDuplicate,  ///< a second board with the same node id
  kEmergencyStop,   ///< the board's emergency stop input is active
  kSupplySag,       ///< of the bridges; the logic has its own
  // joints
  kEncoderFreeze,
  kEncoderJump,
  kEncoderUnplug,
  kMotorOverheat,
  kSpringBreak,
  // buses
  kBusDown,  ///< a cut cable, or a switched-off interface
  // the body
  kPush,     ///< a force on a link, from outside
  kPayload,  ///< a link carries something
};
inline constexpr std::array<std::string_view, 21> kFaultNames = {
    "none",           "frame_drop",     "frame_delay",     "frame_duplicate",
    "frame_corrupt",  "frame_reorder",  "board_kill",      "board_reset",
    "board_identity", "board_revision", "board_duplicate", "emergency_stop",
    "supply_sag",     "encoder_freeze", "encoder_jump",    "encoder_unplug",
    "motor_overheat", "spring_break",   "bus_down",        "push",
    "payload"};

/// What a fault strikes.
enum class FaultTarget : std::uint8_t { kNone = 0, kJoint, kBoard, kSensor, kBus };

/// An injected fault that has begun; a push also, `over`, once it has ended.
struct InjectedFault {
  FaultKind kind = FaultKind::kNone;
  FaultTarget target = FaultTarget::kNone;  ///< kNone: frames of every bus
  std::int32_t index = -1;  ///< in the configuration; a push's row; a payload's number, < 0: gone
  bool over = false;
};

/// As a scenario's `kind` says it.
[[nodiscard]] constexpr std::string_view to_string(FaultKind kind) noexcept {
  const auto index = static_cast<std::size_t>(kind);
  return index < kFaultNames.size() ? kFaultNames[index] : "?";
}

}  // namespace tandem::hal
