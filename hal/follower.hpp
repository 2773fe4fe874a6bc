// A joint that has no drive of its own because it follows one that has (URDF: mimic).
// Layer: hal.  Thread: any.
#pragma once

#include <cstddef>
#include <string>

namespace tandem::hal {

/// Its position is `multiplier` times that of a joint of the image, plus `offset`.
struct Follower {
  std::string name;
  std::size_t leader = 0;  ///< in the image
  double multiplier = 1.0;
  double offset = 0.0;  ///< [rad or m]
};

}  // namespace tandem::hal
