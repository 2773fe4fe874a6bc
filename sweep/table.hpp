// The results as a table: for spreadsheets (CSV) and for questions (SQLite).
// Layer: sweep.  Thread: one at a time.
#pragma once

#include <functional>
#include <string>
#include <variant>
#include <vector>

#include "base/result.hpp"
#include "sweep/results.hpp"
#include "sweep/study.hpp"

namespace tandem::sweep {

/// Nothing, a truth or whole number, a number, a text.
using Cell = std::variant<std::monostate, std::int64_t, double, std::string>;

/// A column of results: a row of columns_of().
struct Column {
  std::string name;
  std::function<Cell(const Point&, const PointResult&)> of;
};

/// What both files have of each point, in this order: its name, what varies, how it ended, and each
/// expectation's margin, "margin: NAME [unit]". Wall-clock times are in none of them.
[[nodiscard]] std::vector<Column> columns_of(
    const Study& study, const std::vector<std::optional<PointResult>>& results);

/// Names and units of the expectations that have a margin in any point, in the order of their
/// first.
struct NamedMargin {
  std::string name, unit;
};
[[nodiscard]] std::vector<NamedMargin> margins_of(
    const std::vector<std::optional<PointResult>>& results);

/// The result of an expectation; null: the point has none of that name.
[[nodiscard]] const runtime::ExpectationResult* expectation_in(const PointResult& result,
                                                               const std::string& name);

/// Writes `results.csv`, `results.sqlite` and `times.csv` to the folder, each as a whole and in the
/// order of the study: the same bytes (but of the times) whoever computed the points.
/// Errors: a file that cannot be written.
[[nodiscard]] Status write_tables(const std::string& folder, const Study& study,
                                  const Points& points,
                                  const std::vector<std::optional<PointResult>>& results);

}  // namespace tandem::sweep
