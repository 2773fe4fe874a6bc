// The limits of a joint's motion: what a device of a controller, an operator's motion and the words
// of a refusal go by.
// Layer: hal.  Thread: any.
#pragma once

#include <cmath>

#include "hal/joint_capabilities.hpp"

namespace tandem::hal {

[[nodiscard]] inline bool reaches(const JointCapabilities& joint,
                                  double position_rad) noexcept TANDEM_RT {
  return std::isfinite(position_rad) && position_rad >= joint.min_position_rad &&
         position_rad <= joint.max_position_rad;
}
/// @param value  a speed, an acceleration: above 0
[[nodiscard]] inline bool is_rate_within(double value, double most) noexcept TANDEM_RT {
  return std::isfinite(value) && value > 0.0 && value <= most;
}

}  // namespace tandem::hal
