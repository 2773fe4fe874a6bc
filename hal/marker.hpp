// A mark as viewers have it: what ROS 2's visualization_msgs/Marker says, for log and DDS.
// Layer: hal.  Thread: any, non-RT.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "hal/mark_block.hpp"

namespace tandem::hal {

/// Type and action are the message's constants.
struct Marker {
  static constexpr std::int32_t kAdd = 0, kDelete = 2;

  std::int32_t type = 0;
  std::int32_t action = kDelete;
  std::array<double, 3> position_m{};  ///< of the points' frame in MarkInfo::link; of a text itself
  std::array<double, 4> quaternion{};  ///< x, y, z, w: the same
  std::array<double, 3> scale_m{};
  std::vector<std::array<double, 3>> points_m;
  std::string text;
};

/// Added when it is whole and all of its places are numbers, else deleted.
/// @param index  of `mark` in its block, whose state this is
[[nodiscard]] Marker marker_of(const MarkInfo& mark, const MarkBlock::State& state,
                               std::size_t index);

}  // namespace tandem::hal
