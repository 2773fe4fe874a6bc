// What a limit of commands changed, with value and limit: for the log and for people.
// Layer: hal.  Thread: made RT; in_words() non-RT.
#pragma once

#include <cstdint>
#include <string>
#include <type_traits>

#include "base/realtime.hpp"

namespace tandem::hal {

/// A field of a joint's command.
enum class CommandField : std::uint8_t {
  kPosition,
  kVelocity,
  kTorque,
  kVoltage,
  kCurrent,
  kStiffness,
  kDamping,
  kMode,
  kInteraction,
};

/// Why it was changed; what is further down goes first.
enum class LimitKind : std::uint8_t {
  kNone,       ///< it was not
  kTooFast,    ///< `limit` is of its derivative
  kAtEnd,      ///< of a velocity: the joint would not stop within its range
  kRange,      ///< `limit` is the bound that it passes
  kNotFinite,  ///< a NaN or an infinity, or a mode that does not exist
};

/// One command of one joint that a limit changed. Plain data: it crosses rings as bytes.
struct LimitMet {
  double value = 0.0;  ///< that was commanded
  double limit = 0.0;  ///< in the unit of the value, or of its derivative
  CommandField field = CommandField::kPosition;
  LimitKind kind = LimitKind::kNone;
  std::uint8_t derivative = 0;  ///< of the value, that `limit` is of: 1 the first
  std::uint8_t slides = 0;      ///< 1: the joint is prismatic, with m and N
  std::uint8_t padding[4] = {};

  [[nodiscard]] Code code() const noexcept TANDEM_RT {
    if (kind == LimitKind::kNotFinite) return Code::kNotFinite;
    return kind == LimitKind::kRange ? Code::kOutOfRange : Code::kOk;
  }
};
static_assert(std::is_trivially_copyable_v<LimitMet> && sizeof(LimitMet) == 24);

/// "position reference 4 rad", "torque nan": the field and what it was commanded to be.
[[nodiscard]] std::string value_in_words(const LimitMet& met);
/// "the position reference 4 rad is beyond 3.14 rad"; empty of kNone.
[[nodiscard]] std::string in_words(const LimitMet& met);

}  // namespace tandem::hal
