// The robot that runs in parallel as a source: where it stands, and how far the run's is from it.
// Layer: studio.  Thread: the studio's.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "hal/image.hpp"
#include "hal/parallel_source.hpp"

namespace tandem::studio {

/// What the 3D view needs. The image has what the second robot did last: it is late by some cycles,
/// and looked at with each tick. Every cycle of it is in the log.
class TwinSource {
 public:
  /// @param view  for its sizes
  explicit TwinSource(const hal::ParallelView& view);

  /// position_rad, difference_rad, passive_position_rad, base_position_m, base_quaternion,
  /// behind_cycles.
  [[nodiscard]] const hal::Layout& layout() const { return layout_; }
  /// What of a joint the parallel robot has not measured yet is NaN, and so is the difference.
  void look(const hal::ParallelView& view);
  /// What look() took, by layout().
  [[nodiscard]] std::span<const std::byte> image() const { return image_; }

  std::size_t source = 0;  ///< in the table of signals

 private:
  hal::Layout layout_;
  std::vector<std::byte> image_;
};

}  // namespace tandem::studio
