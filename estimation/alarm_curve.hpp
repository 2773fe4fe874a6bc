// What collision thresholds cost and what they find, for factors on them: false alarms in free
// motion, and the time to detection of pushes.
// Layer: estimation.  Thread: one at a time, non-RT.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace tandem::estimation {

/// How far the joint that is furthest beyond its threshold is: 1 at the threshold.
[[nodiscard]] double worst_ratio(std::span<const double> external_torque_Nm,
                                 std::span<const double> threshold_Nm);

/// Counts false alarms in motion that touched nothing: blocks of time in which a joint is beyond
/// its threshold. So one that stays beyond, or several at once, are one alarm a block.
class FalseAlarms {
 public:
  /// @param threshold_Nm  by joint
  /// @param block         cycles; what is left at a run's end is not counted
  FalseAlarms(std::span<const double> threshold_Nm, std::uint32_t block)
      : threshold_Nm_(threshold_Nm.begin(), threshold_Nm.end()), block_(block) {}

  /// Before the first cycle of each run.
  void begin_run();
  /// One cycle. @param external_torque_Nm  by joint
  void look(std::span<const double> external_torque_Nm);

  /// Cycles in whole blocks.
  [[nodiscard]] std::uint64_t cycles() const { return blocks_.size() * block_; }
  /// With all thresholds multiplied by `factor`.
  [[nodiscard]] std::uint64_t alarms(double factor) const;

 private:
  std::vector<double> threshold_Nm_, blocks_;  // the worst ratio of each
  std::uint32_t block_;
  std::uint32_t in_block_ = 0;
  double worst_ = 0.0;
};

/// Times pushes until a joint is beyond its threshold.
class DetectionTimes {
 public:
  /// @param threshold_Nm  by joint
  /// @param factors       on all of them
  DetectionTimes(std::span<const double> threshold_Nm, std::span<const double> factors);

  void begin_push();
  /// One cycle of the push; the first is number 1.
  void look(std::span<const double> external_torque_Nm);

  /// Detection of all pushes, with one factor.
  struct Summary {
    std::size_t pushes = 0, found = 0;
    double median = 0.0, worst = 0.0;  ///< [cycles]; infinite when that push was not found
  };
  [[nodiscard]] Summary with(std::size_t factor) const;

 private:
  std::vector<double> threshold_Nm_, factors_;
  std::vector<std::vector<double>> found_;  // by push, factor: cycles, infinite: not yet
  double cycle_ = 0.0;                      // of the push that is timed
};

}  // namespace tandem::estimation
