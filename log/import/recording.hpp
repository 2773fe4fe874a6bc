// A recording of another program in memory, before it is put on the cycles of a log.
// Layer: log/import.  Thread: any, non-RT.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "base/result.hpp"

namespace tandem::log {

/// Which number of an image a column becomes.
struct Target {
  bool command = false;   ///< of the command image; else of the state image
  std::string field;      ///< on the wire: "position_rad", "sensor"
  std::size_t index = 0;  ///< element: the joint's, or the channel's
};

/// One number over time. SI, link side, in the image's signs.
struct ImportedColumn {
  std::string name;  ///< for messages: "q1", "/joint_states elbow position"
  std::string file;  ///< for messages
  Target target;
  std::vector<double> values;

  /// Whether it is a joint's position, as measured.
  [[nodiscard]] bool is_position() const {
    return !target.command && target.field == "position_rad";
  }
};

/// Columns that were measured at the same times: those of a CSV, or of one joint or sensor in a
/// bag.
struct ImportedSeries {
  std::string name;                      ///< for messages: "joint elbow"
  std::vector<std::size_t> joints;       ///< whose state they are
  std::vector<std::size_t> sensors;      ///< the same
  std::vector<std::int64_t> time_ns;     ///< of each row, on the recording's clock
  std::vector<int> line;                 ///< of each row in its file; empty: rows have none
  std::vector<std::uint32_t> message;    ///< of a bag, that each row is from; empty of a table
  std::vector<ImportedColumn> columns;   ///< as long as time_ns
  std::vector<std::size_t> quaternions;  ///< the first of four columns that are one

  [[nodiscard]] std::size_t rows() const { return time_ns.size(); }
  /// The log's cycles are where the positions are. Any other series has what it has there.
  [[nodiscard]] bool has_positions() const {
    return std::ranges::any_of(columns, &ImportedColumn::is_position);
  }
};

/// What was left out, because the map says so. Counted for the summary and the log: rows of a
/// table, messages of a bag, each once, whatever number of joints it has.
struct Exclusions {
  std::uint64_t invalid =
      0;  ///< with a cell that is empty or not finite, a joint twice, lists of other lengths
  std::uint64_t ragged = 0;          ///< with too few or too many cells
  std::uint64_t duplicates = 0;      ///< whose time is the row's before
  std::uint64_t backwards = 0;       ///< whose time is before that of an earlier row
  std::uint64_t gaps = 0;            ///< pauses longer than max_gap_s
  std::uint64_t gap_cycles = 0;      ///< cycles in them, which the log lacks
  std::vector<std::string> frozen;   ///< columns that never change
  std::vector<std::string> ignored;  ///< columns, joints or topics that are not used
};

/// Drops all rows but these, which are in rising order.
void keep_rows(ImportedSeries& series, const std::vector<std::size_t>& rows);

/// How many different numbers there are.
[[nodiscard]] std::uint64_t distinct(std::vector<std::uint32_t> numbers);

/// A whole recording.
struct ImportedRecording {
  std::vector<ImportedSeries> series;
  Exclusions excluded;
  std::vector<std::string> notes;  ///< what was taken how, for the summary
};

}  // namespace tandem::log
