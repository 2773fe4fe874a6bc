// A joint that has no drive of its own because it follows one that has (URDF: mimic).
// Layer: hal.  Thread: any.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>

#include "base/result.hpp"

namespace tandem::hal {

/// Its position is `multiplier` times that of a joint of the image, plus `offset`.
struct Follower {
  std::string name;
  std::size_t leader = 0;  ///< in the image
  double multiplier = 1.0;
  double offset = 0.0;  ///< [rad or m]
};

/// What is wrong with a name that is none of the image's joints: a follower's leader is named, else
/// the nearest name.
/// @param joints  in the image's order
[[nodiscard]] Error no_joint(std::string_view name, std::span<const std::string> joints,
                             std::span<const Follower> followers);

}  // namespace tandem::hal
