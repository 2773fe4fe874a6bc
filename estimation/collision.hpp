// Which joints feel more than the robot's own motion explains, and from which torque on.
// Layer: estimation.  Thread: CollisionWatch made non-RT, the rest RT; learn_threshold() non-RT.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "base/archive.hpp"
#include "base/realtime.hpp"

namespace tandem::estimation {

/// What is watched of a floating base, beside its joints: names as in `threshold_Nm` and in the
/// order of EstimateImage::external_base_wrench.
inline constexpr std::array<const char*, 6> kBaseChannels{"base_force_x",  "base_force_y",
                                                          "base_force_z",  "base_moment_x",
                                                          "base_moment_y", "base_moment_z"};

/// Compares external torques with a threshold by joint; behind the joints by kBaseChannels. A joint
/// is found once: again after its torque has been below the threshold for `quiet` cycles. The
/// base's channels are one in this: whatever strikes it is in several of them.
class CollisionWatch {
 public:
  /// @param threshold_Nm  by joint, then by channel of the base; infinite: not watched
  CollisionWatch(std::vector<double> threshold_Nm, std::size_t joints, std::uint32_t quiet);

  struct Found {
    std::size_t joint = 0;  ///< or, from the number of joints on, which of kBaseChannels
    double torque_Nm = 0.0;
  };
  /// One cycle: marks the joints that are beyond their thresholds. The first that is new, the one
  /// furthest beyond its threshold, or nothing.
  /// @param collided  by joint, written: 1 beyond
  [[nodiscard]] std::optional<Found> look(std::span<const double> external_torque_Nm,
                                          std::span<std::uint8_t> collided) noexcept TANDEM_RT;
  [[nodiscard]] double threshold_Nm(std::size_t joint) const noexcept {
    return threshold_Nm_[joint];
  }

  void archive(Archive& ar) { ar(quiet_for_); }

 private:
  std::vector<double> threshold_Nm_;
  std::vector<std::uint32_t> quiet_for_;  // cycles that are left until it can be found again
  std::size_t joints_;
  std::uint32_t quiet_;
};

/// The threshold that a joint's torque without a collision exceeds with this rate at most, from the
/// largest magnitudes in blocks of equal length of several runs.
///
/// The quantile of the Gumbel distribution of the same mean and variance, which is what maxima of
/// many samples tend to, and never less than the largest: of all blocks, and of each run's alone,
/// whichever is larger. Runs differ, as a joint sticks in one and slips in the next, and a fit of
/// all blocks alone is too low where few of the runs slip. Beyond what was recorded it is an
/// extrapolation; it holds for motion like that of the runs.
/// @param largest_Nm        by run, of each block; at least 8 a run
/// @param alarms_per_hour   of this joint; above 0
[[nodiscard]] double learn_threshold(std::span<const std::vector<double>> largest_Nm,
                                     double block_s, double alarms_per_hour);

}  // namespace tandem::estimation
