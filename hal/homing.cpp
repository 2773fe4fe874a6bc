#include "hal/homing.hpp"

namespace tandem::hal {

const char* to_string(HomingState state) noexcept {
  switch (state) {
    case HomingState::kNone: return "none";
    case HomingState::kNotHomed: return "not homed";
    case HomingState::kHoming: return "under way";
    case HomingState::kHomed: return "homed";
  }
  return "none";
}

}  // namespace tandem::hal
