// From a recording's own times to the cycles of a log.
// Layer: log/import.  Thread: any, non-RT.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "hal/config/robot_config.hpp"
#include "hal/image.hpp"
#include "log/import/import_map.hpp"
#include "log/import/recording.hpp"

namespace tandem::log {

/// How a series is spaced in time, for the summary.
struct Spacing {
  std::string name;
  std::size_t rows = 0;
  std::int64_t median_ns = 0, least_ns = 0, most_ns = 0;
  std::size_t late = 0;  ///< samples more than kLateSteps medians after the one before

  static constexpr double kLateSteps = 1.5;
  static constexpr double kMostLate = 0.01;  ///< of the samples: what is between them is made up

  /// Whether more than kMostLate of them are late.
  [[nodiscard]] bool jitters() const {
    return static_cast<double>(late) > kMostLate * static_cast<double>(rows);
  }
};

/// Checks a recording's times and values, and leaves out what the map excludes: rows before begin_s
/// and after end_s without a word, the others counted.
///
/// Errors, with file and line or the sample's number: time that goes back, duplicates, gaps,
/// columns that never change, as far as the map does not exclude them; positions with less than
/// two samples, other columns without any; no period_s, with what the positions' own is, or one
/// that is 50 times as long or as short; a position further outside of its joint's range than that
/// is wide; a position that leaps by a turn; a torque above a hundred times its joint's; a velocity
/// that is not the rate of its position, within a factor of two, where the joint moves.
[[nodiscard]] Status clean(ImportedRecording& recording, const ImportMap& map,
                           const hal::RobotConfig& robot);

/// Spacing of each series. @pre clean() went well
[[nodiscard]] std::vector<Spacing> spacings(const ImportedRecording& recording);

/// Fills the images of one cycle after another.
class Sampler {
 public:
  /// Errors: the joints' positions have no time in common.
  [[nodiscard]] static Result<Sampler> create(const ImportedRecording& recording,
                                              const ImportMap& map, const hal::RobotConfig& robot);

  [[nodiscard]] std::uint64_t cycles() const { return cycles_; }
  /// Time of cycle 0, on the recording's clock.
  [[nodiscard]] std::int64_t begin_ns() const { return begin_ns_; }

  /// Cycle `cycle`, which must not be before the last one asked for.
  /// Numbers that the recording does not have are NaN.
  /// @return false: a joint's position has a gap here; the images are not to be used
  [[nodiscard]] bool fill(std::uint64_t cycle, hal::StateImage& state, hal::CommandImage& command);

 private:
  Sampler(const ImportedRecording& recording, const ImportMap& map, const hal::RobotConfig& robot);
  [[nodiscard]] double value_of(const ImportedColumn& column, std::size_t row, double share) const;
  bool fill_series(std::size_t index, std::int64_t now_ns, hal::StateImage& state,
                   hal::CommandImage& command);
  void normalise(std::size_t index, hal::StateImage& state) const;

  const ImportedRecording& recording_;
  const ImportMap& map_;
  hal::StateImage blank_state_;  // a cycle of which nothing is known
  hal::CommandImage blank_command_;
  std::vector<std::vector<std::size_t>> offsets_;  // bytes, of each column in its image
  std::vector<std::size_t> row_;  // of each series: the last one that is not after the cycle
  std::vector<std::int64_t> max_gap_ns_;
  std::int64_t begin_ns_ = 0;
  std::uint64_t cycles_ = 0;
};

}  // namespace tandem::log
