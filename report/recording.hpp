// Logs as the studio's page shows them: every number as a signal, with the names that a live run
// gives it, over equal spans of time; events; what the figures show. docs/studio.md says what is
// lost.
// Layer: report.  Thread: non-RT only.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "log/log_file.hpp"
#include "report/figure.hpp"
#include "report/spans.hpp"
#include "studio/messages.hpp"
#include "studio/signal_table.hpp"

namespace tandem::report {

/// A log of the page.
struct RecordedLog {
  const log::LogFile* file = nullptr;
  std::string prefix{};  ///< before the names of its sources: "B/"; empty: the first log
  double later_s = 0.0;  ///< added to its times, after they were
  double slower = 1.0;   ///< multiplied by this
};

/// How fine a recording may be.
struct RowLimits {
  std::size_t rows = 0;
  std::size_t numbers = 0;  ///< of all signals in all rows [8 bytes each]
};
/// Those of a report: of COMAN some 4,200 rows.
inline constexpr RowLimits kReportRows{40'000, 4'000'000};

/// Those of a log that is served: 512 MB at most.
inline constexpr RowLimits kServedRows{100'000'000, 64'000'000};

/// What is recorded.
struct RecordingParts {
  studio::RunDescription run;  ///< of the first log
  std::vector<RecordedLog> logs;
  std::vector<Figure> figures{};  ///< those over time become signals, too:
                                  ///< "report/joint_position.measured"
  double at_s = 0.0;              ///< the time that is shown at first
  RowLimits most = kReportRows;
};

/// Events that the page has, of each log: the first ones.
inline constexpr std::size_t kMostRecordedEvents = 2000;

class Recording {
 public:
  /// Reads every number of the logs. @pre there is one
  /// Errors: LogFile::visit()'s; a log without a number that has a time.
  [[nodiscard]] static Result<Recording> read(const RecordingParts& parts);

  [[nodiscard]] const studio::SignalTable& table() const { return table_; }
  [[nodiscard]] const Spans& spans() const { return spans_; }
  /// Those of the first log's robot; empty: not known.
  [[nodiscard]] const std::vector<hal::JointConfig>& joints() const { return joints_; }

  /// What the page unpacks: JSON that is safe within an HTML script element.
  struct Text {
    std::string json;
    Grid grid;  ///< that it has
  };
  /// @param most  bytes: there are as many rows as fit, up to kReportRows
  [[nodiscard]] Text text(std::size_t most) const;
  /// A frame of studio.md: the rows of some signals in a span, merged to 2 * points where there are
  /// more than 4 * points. Signals that it has not are gaps.
  [[nodiscard]] std::string window(const std::vector<std::size_t>& signals, double from_s,
                                   double to_s, std::size_t points) const;

 private:
  Recording(const Grid& grid, studio::SignalTable table, std::vector<hal::JointConfig> joints)
      : table_(std::move(table)), spans_(grid, table_.size()), joints_(std::move(joints)) {}

  studio::SignalTable table_;
  Spans spans_;
  std::vector<hal::JointConfig> joints_;
  std::string head_;  // JSON of all but grid, codes and data
};

}  // namespace tandem::report
