// The one-frame messages of CiA 301 as make/parse pairs: NMT, SYNC, TIME, heartbeat, emergency.
// Layer: canopen.  Thread: any.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "base/realtime.hpp"
#include "canopen/frame.hpp"
#include "canopen/objects.hpp"

namespace tandem::canopen {

/// NMT states as the heartbeat carries them.
enum class NmtState : std::uint8_t {
  kBootUp = 0,
  kStopped = 4,
  kOperational = 5,
  kPreOperational = 127,
};
[[nodiscard]] const char* to_string(NmtState state) noexcept;

enum class NmtCommand : std::uint8_t {
  kStart = 1,
  kStop = 2,
  kEnterPreOperational = 128,
  kResetNode = 129,
  kResetCommunication = 130,
};

/// Frame 000: byte 0 command, byte 1 node id, 0 for every node.
struct NmtMessage {
  NmtCommand command = NmtCommand::kStart;
  std::uint8_t node = 0;
};
[[nodiscard]] Frame make_nmt(NmtCommand command, int node) noexcept TANDEM_RT;
/// Empty when the frame is no NMT command or one of an unknown number.
[[nodiscard]] std::optional<NmtMessage> parse_nmt(const Frame& frame) noexcept TANDEM_RT;

/// Frame 080 without data.
[[nodiscard]] Frame make_sync() noexcept TANDEM_RT;

/// Frame 100, TIME: bytes 0-3 milliseconds after midnight (28 bits), bytes 4-5 days.
/// @param time_ns  since midnight of day 0, not negative
[[nodiscard]] Frame make_time(std::int64_t time_ns) noexcept TANDEM_RT;

/// What a master in lockstep asks of an emulated robot's state, and what that has to say of it.
enum class PastOrder : std::uint8_t {
  kKeep = 1,    ///< keep it, by this number
  kGoBack = 2,  ///< be as it was when that number was kept
  kDrop = 3,    ///< forget that number; 0: all of them
  kHeard = 4,   ///< from the robot alone: this step has taken something from outside
};
/// Why an order was not carried out.
enum class PastRefusal : std::uint8_t {
  kNone = 0,      ///< it was
  kNoMemory = 1,  ///< for another state
  kUnknown = 2,   ///< nothing is kept by that number
  kNoOrder = 3,   ///< that one this robot does not know
};
/// Frame 101, in lockstep alone: byte 0 order, bytes 1-4 number.
struct PastOrderMessage {
  PastOrder order = PastOrder::kKeep;
  std::uint32_t number = 0;
  bool operator==(const PastOrderMessage&) const = default;
};
[[nodiscard]] Frame make_past_order(const PastOrderMessage& message) noexcept TANDEM_RT;
/// Empty when the frame is none. Its order may be one that nobody knows.
[[nodiscard]] std::optional<PastOrderMessage> parse_past_order(
    const Frame& frame) noexcept TANDEM_RT;

/// Frame 102: the order with its number, byte 5 refusal, bytes 6-7 size of what is kept by it.
struct PastAnswerMessage {
  static constexpr std::size_t kSizeUnit = 16'384;  ///< bytes

  PastOrderMessage to;
  PastRefusal refusal = PastRefusal::kNone;
  std::uint16_t size = 0;  ///< in kSizeUnit, rounded up
};
[[nodiscard]] Frame make_past_answer(const PastAnswerMessage& message) noexcept TANDEM_RT;
[[nodiscard]] std::optional<PastAnswerMessage> parse_past_answer(
    const Frame& frame) noexcept TANDEM_RT;

/// Frame 700 + node: byte 0 state. Boot-up is the state 0, sent once.
struct HeartbeatMessage {
  std::uint8_t node = 0;
  NmtState state = NmtState::kBootUp;
};
[[nodiscard]] Frame make_heartbeat(int node, NmtState state) noexcept TANDEM_RT;
/// Node guarding: the remote request that node `node` answers with its state.
[[nodiscard]] Frame make_guard_request(int node) noexcept TANDEM_RT;
[[nodiscard]] std::optional<HeartbeatMessage> parse_heartbeat(
    const Frame& frame) noexcept TANDEM_RT;

/// Frame 080 + node: bytes 0-1 error code, byte 2 error register, bytes 3-7 the manufacturer's.
/// Error code 0 says that every error is gone. Ours: byte 3 is the axis, counted from 0.
struct EmergencyMessage {
  std::uint8_t node = 0;
  ErrorCode code = ErrorCode::kNone;
  std::uint8_t error_register = 0;
  std::array<std::uint8_t, 5> manufacturer{};
};
[[nodiscard]] Frame make_emergency(const EmergencyMessage& message) noexcept TANDEM_RT;
[[nodiscard]] std::optional<EmergencyMessage> parse_emergency(
    const Frame& frame) noexcept TANDEM_RT;

}  // namespace tandem::canopen
