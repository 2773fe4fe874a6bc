#include "report/spans.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace tandem::report {

std::optional<std::size_t> Grid::row_of(double time_s) const {
  const double cycle = std::floor((time_s - start_s) / period_s + 0.5);
  if (!(cycle >= 0.0) || cycle >= static_cast<double>(rows * cycles)) return {};
  return static_cast<std::size_t>(cycle) / cycles;
}

std::size_t Grid::held_rows(double step_s, bool exact) const {
  constexpr double kSeldom = 1.001;  // rows between two samples: more, and some rows have none
  const double rows_of_one = step_s / this->step_s();
  if (!std::isfinite(rows_of_one) || rows_of_one <= 0.0) return 0;
  if (rows_of_one <= kSeldom) return exact ? 0 : 1;
  return static_cast<std::size_t>(std::ceil(2.0 * rows_of_one));
}

Grid Grid::over(double start_s, double end_s, double period_s, std::size_t most) {
  Grid grid{.start_s = start_s, .period_s = period_s};
  const double cycles = std::floor((end_s - start_s) / period_s + 0.5) + 1.0;
  grid.cycles = static_cast<std::size_t>(std::ceil(cycles / static_cast<double>(most)));
  grid.rows = static_cast<std::size_t>(std::ceil(cycles / static_cast<double>(grid.cycles)));
  return grid;
}

Spans::Spans(const Grid& grid, std::size_t signals)
    : grid_(grid),
      signals_(signals),
      least_(signals * grid.rows, std::numeric_limits<float>::quiet_NaN()),
      largest_(least_) {}

std::span<const float> Spans::least(std::size_t signal) const {
  return std::span(least_).subspan(signal * grid_.rows, grid_.rows);
}

std::span<const float> Spans::largest(std::size_t signal) const {
  return std::span(largest_).subspan(signal * grid_.rows, grid_.rows);
}

void Spans::add(std::size_t signal, std::size_t row, float value) {
  if (!std::isfinite(value)) return;
  const std::size_t at = signal * grid_.rows + row;
  if (!(least_[at] <= value)) least_[at] = value;
  if (!(largest_[at] >= value)) largest_[at] = value;
}

void Spans::hold(std::size_t signal, std::size_t rows) {
  const std::size_t begin = signal * grid_.rows;
  std::size_t since = rows;  // since the last number
  float last = std::numeric_limits<float>::quiet_NaN();
  for (std::size_t at = begin; at < begin + grid_.rows; ++at) {
    if (std::isfinite(largest_[at])) {
      last = largest_[at];
      since = 0;
    } else if (since < rows) {
      ++since;
      least_[at] = largest_[at] = last;
    }
  }
}

}  // namespace tandem::report
