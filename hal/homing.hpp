// How a joint without an absolute encoder learns where it is: what is known of it.
// Layer: hal.  Thread: plain data.
#pragma once

#include <cstdint>

#include "hal/stop_category.hpp"

namespace tandem::hal {

enum class HomingState : std::uint8_t {
  kNone = 0,  ///< the joint has no homing: its encoder is absolute
  kNotHomed,  ///< its position is not known; after a power loss again
  kHoming,    ///< its drive looks for it
  kHomed,     ///< its position is known, until the drive's power is lost
};
/// For JSON and tables: "none", "not homed", "under way", "homed".
[[nodiscard]] const char* to_string(HomingState state) noexcept;

struct Homing {
  HomingState state = HomingState::kNone;
  FaultCause error = FaultCause::kNone;  ///< why the last one did not find the joint's place
};

}  // namespace tandem::hal
