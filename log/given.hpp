// What a cycle took from outside that is in no image, event or input of the log, as its channel
// /tandem/given carries it: with it the cycle can be played again.
// Layer: log.  Thread: plain data.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <type_traits>

#include "hal/image.hpp"

namespace tandem::log {

/// What was given. The numbers are in logs: new ones go to the end.
enum class GivenKind : std::uint8_t {
  kStop = 1,    ///< an emergency stop; values: hal::StopCategory
  kReset,       ///< of all faults; values: the cycle up to which stops were known, -1: all
  kInsert,      ///< a controller came into slot `index`
  kRemove,      ///< what is in slot `index` went
  kReplace,     ///< what is in slot `index` was loaded anew
  kSwitch,      ///< controllers of `stop` and `start`
  kGoOn,        ///< those that waited
  kJoint,       ///< joint `index`; values: stiffness, damping, mode, interaction
  kGains,       ///< joint `index`; values: kp, ki, kd, hal::PidLoop
  kRecover,     ///< joint `index`
  kMove,        ///< joint `index`; values: target, speed, acceleration
  kResetDrive,  ///< joint `index`
  kHome,        ///< joint `index`
  kCause,       ///< why joint `index` is in fault; values: hal::FaultCause
  kShadow,      ///< what is in slot `index` runs as a shadow
  kEndShadow,   ///< it does no longer
  kSwitchWhen,  ///< as kSwitch, once they agree; values: within, cycles. Of none: it waits no more
  kLink,        ///< the declared link; values: delay, jitter, loss, 1 up + 2 down
};

/// Plain data: it crosses the ring as bytes, and the first kGivenBytes of them are the message.
struct Given {
  std::uint64_t cycle = 0;
  std::int64_t time_ns = 0;
  std::array<double, 4> values{};  ///< NaN: as it is
  std::uint32_t start = 0;         ///< a bit per slot
  std::uint32_t stop = 0;          ///< the same
  std::int32_t index = -1;
  GivenKind kind = GivenKind::kStop;
};
inline constexpr std::size_t kGivenBytes = offsetof(Given, kind) + sizeof(GivenKind);
static_assert(std::is_trivially_copyable_v<Given> && kGivenBytes == 61);

inline constexpr const char* kGivenTopic = "/tandem/given";

/// The message's.
[[nodiscard]] const hal::Layout& given_layout();
/// Empty: the body is too short.
[[nodiscard]] std::optional<Given> decode_given(std::span<const std::byte> body);

}  // namespace tandem::log
