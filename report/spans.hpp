// The numbers of logs over equal spans of time: least and largest of each, so that a spike of one
// cycle is seen however few spans there are.
// Layer: report.  Thread: non-RT only.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

namespace tandem::report {

/// Equal spans of time: rows of so many cycles.
struct Grid {
  double start_s = 0.0;  ///< of the first row
  double period_s = 1e-3;
  std::size_t cycles = 1;  ///< of a row
  std::size_t rows = 0;

  [[nodiscard]] double step_s() const { return period_s * static_cast<double>(cycles); }
  /// The row of a time; empty: it is outside.
  [[nodiscard]] std::optional<std::size_t> row_of(double time_s) const;
  /// For how many rows a number stands that is sampled every `step_s`.
  /// @param exact  where there is a sample for each row, it stands for no other
  [[nodiscard]] std::size_t held_rows(double step_s, bool exact) const;
  /// The finest grid from `start_s` to `end_s` that has no more than `most` rows.
  [[nodiscard]] static Grid over(double start_s, double end_s, double period_s, std::size_t most);
};

/// Least and largest of each signal in each row; NaN: a gap.
class Spans {
 public:
  Spans(const Grid& grid, std::size_t signals);

  [[nodiscard]] const Grid& grid() const { return grid_; }
  [[nodiscard]] std::size_t signals() const { return signals_; }
  [[nodiscard]] std::span<const float> least(std::size_t signal) const;
  [[nodiscard]] std::span<const float> largest(std::size_t signal) const;

  /// A number in a row. What is not finite counts as none.
  void add(std::size_t signal, std::size_t row, float value);
  /// What is sampled more seldom than there are rows keeps its number until the next sample.
  /// @param rows  for so many rows at most; what lacks longer stays a gap
  void hold(std::size_t signal, std::size_t rows);

 private:
  Grid grid_;
  std::size_t signals_;
  std::vector<float> least_, largest_;  // signal by signal
};

}  // namespace tandem::report
