// A table of text, row by row: comma-separated values and their relatives.
// Layer: log/import.  Thread: one at a time, non-RT.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.hpp"
#include "log/import/import_map.hpp"

namespace tandem::log {

/// A date of ISO 8601 as nanoseconds since 1970 in UTC: "2026-11-26T22:02:12.5Z", with a blank for
/// the T, with a comma, without seconds, with "+01:00" or "+0100" for the Z; without either it is
/// taken for UTC. Instead of the year first with dashes or slashes also the day first with dots:
/// "26.11.2026 22:02:12". None: it is no such date.
[[nodiscard]] std::optional<std::int64_t> date_time_ns(std::string_view text);

/// Whether it begins as "11/12/2026": nobody knows which is the day.
[[nodiscard]] bool is_ambiguous_date(std::string_view text);

/// Reads the lines of a text in order. A byte order mark, CRLF and quotes about a cell are
/// tolerated; a delimiter at the end of every line as well.
class CsvRows {
 public:
  /// Reads up to the first row. The text outlives this.
  /// @param file  names it in errors
  /// Errors: no row at all; a column without a name, or two of one name.
  [[nodiscard]] static Result<CsvRows> open(std::string_view text, const std::string& file,
                                            const CsvFormat& format);

  /// Names of the columns: the header's, or c1, c2, …
  [[nodiscard]] const std::vector<std::string>& names() const { return names_; }
  /// The next row's cells, without blanks and quotes; false at the end.
  [[nodiscard]] bool next();
  [[nodiscard]] bool empty(std::size_t column) const { return cells_[column].empty(); }
  /// As many as there are names, unless the row is ragged.
  [[nodiscard]] std::span<const std::string_view> cells() const { return cells_; }
  /// Line of the row in the file, from 1.
  [[nodiscard]] int line() const { return line_; }
  /// A cell's number; NaN for an empty cell, nan and inf; none: it is no number.
  [[nodiscard]] std::optional<double> number(std::size_t column) const;
  /// A time in units of `unit_ns`, rounded to a nanosecond; of unit 0 a date (date_time_ns()).
  /// None: no number, or no date; beyond 292 years.
  [[nodiscard]] std::optional<std::int64_t> time_ns(std::size_t column, std::int64_t unit_ns) const;

 private:
  [[nodiscard]] bool next_line();
  void split(std::string_view line);
  [[nodiscard]] std::string digits_of(std::size_t column) const;

  CsvFormat format_;
  std::string_view rest_, text_line_;
  std::vector<std::string> names_;
  std::vector<std::string_view> cells_;
  int line_ = 0;
  bool pending_ = false;  // the first row has been read with the header
};

/// What a time is that is not read, though people write it so, and what to do: one without a date,
/// of a zone that is named, of a 12-hour clock. None: it is no such time.
[[nodiscard]] std::optional<Error> refused_time(std::string_view cell);

}  // namespace tandem::log
