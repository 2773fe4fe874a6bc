// How far two robots are apart that get the same commands: per joint and per sensor channel.
// Layer: internal_model.  Thread: one.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/archive.hpp"
#include "hal/image.hpp"

namespace tandem::internal_model {

/// First minus second of one signal, over the cycles that were taken.
struct SignalDifference {
  double max = 0.0;  ///< of the absolute value
  double square_sum = 0.0;

  void take(double difference) noexcept;
};

/// Differences of a joint, link side: [rad, rad/s, Nm], of a prismatic one [m, m/s, N].
struct JointDifference {
  SignalDifference position_rad, velocity_rad_s, torque_Nm;
};

/// Figures of two robots' states.
class Differences {
 public:
  explicit Differences(const hal::ImageShape& shape)
      : joints_(shape.joints), channels_(shape.channels()) {}

  /// Whether the two are the same bytes, in every cycle. @pre both have this shape
  void compare(const hal::StateImage& first, const hal::StateImage& second) noexcept;
  /// Figures of a cycle in which both follow their command. @pre the same
  void take(const hal::StateImage& first, const hal::StateImage& second) noexcept;

  /// Bases of the same cycle, where both are known. @param first, second  position [m], quaternion
  void take_base(std::span<const double, 7> first, std::span<const double, 7> second) noexcept;

  /// Cycles of compare().
  [[nodiscard]] std::uint64_t compared() const noexcept { return compared_; }
  /// Cycles of take().
  [[nodiscard]] std::uint64_t cycles() const noexcept { return cycles_; }
  /// Cycles of compare() in which the two images, every field of them, were not the same bytes.
  [[nodiscard]] std::uint64_t unequal() const noexcept { return unequal_; }
  /// The first of them; -1: there was none.
  [[nodiscard]] std::int64_t first_unequal() const noexcept { return first_unequal_; }
  [[nodiscard]] const std::vector<JointDifference>& joints() const noexcept { return joints_; }
  /// All sensors' channels, one sensor after another, in their own units.
  [[nodiscard]] const std::vector<SignalDifference>& channels() const noexcept { return channels_; }
  /// How far the bases are apart [m], and by which angle they are turned [rad]. Null: not known.
  [[nodiscard]] const SignalDifference* base_position_m() const noexcept {
    return bases_ ? &base_position_m_ : nullptr;
  }
  [[nodiscard]] const SignalDifference* base_angle_rad() const noexcept {
    return bases_ ? &base_angle_rad_ : nullptr;
  }
  void archive(Archive& ar) {
    ar(joints_, channels_, base_position_m_, base_angle_rad_, bases_);
    ar(compared_, cycles_, unequal_, first_unequal_);
  }
  /// The root of the mean square of one of them.
  [[nodiscard]] double rms(const SignalDifference& one) const noexcept;

 private:
  std::vector<JointDifference> joints_;
  std::vector<SignalDifference> channels_;
  SignalDifference base_position_m_, base_angle_rad_;
  bool bases_ = false;
  std::uint64_t compared_ = 0, cycles_ = 0, unequal_ = 0;
  std::int64_t first_unequal_ = -1;
};

}  // namespace tandem::internal_model
