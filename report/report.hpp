// The report of a run, or of two or three laid over each other. Start here.
// Layer: report.  Thread: non-RT only.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "model/kernels.h"
#include "report/page.hpp"
#include "report/recording.hpp"
#include "report/run_data.hpp"

namespace tandem::report {

/// Finds the kernels of a run's robot; null when there are none that fit.
using FindKernels = std::function<const tandem_kernels*(const RunData&)>;

/// A log of a report, as RecordedLog.
struct ReportedLog {
  std::string path;
  std::string prefix;
  double later_s = 0.0, slower = 1.0;
};

/// What a report shows, before anything is written.
struct Report {
  studio::RunDescription run;  ///< of the first log
  std::vector<ReportedLog> logs;
  std::vector<Figure> figures;
  Page page;
  double at_s = 0.0;                 ///< where the first log's controllers start
  std::vector<std::string> remarks;  ///< what it lacks, and why
};

/// Reads `log`, and up to two others that are laid over it.
/// Errors: read_run()'s; logs of different robots.
[[nodiscard]] Result<Report> read_report(const std::string& log,
                                         const std::vector<std::string>& others,
                                         const FindKernels& find_kernels,
                                         const ErrorText& error_text = {});
/// The same. A log that is no whole run's, as one without its robot's files, has its numbers and
/// events alone.
[[nodiscard]] Result<Report> read_any(const std::string& log,
                                      const std::vector<std::string>& others,
                                      const FindKernels& find_kernels,
                                      const ErrorText& error_text = {});
/// The numbers of its logs. Errors: Recording::read()'s.
[[nodiscard]] Result<Recording> record(const Report& report, const RowLimits& most);

struct ReportFiles {
  std::string page;                  ///< report.html
  std::vector<std::string> images;   ///< PNG, one per figure, and the overview; none of a log that
                                     ///< has no figures
  std::vector<std::string> remarks;  ///< what the report lacks, and why
};

/// Draws the report of `log`, and of up to two others laid over it, into `folder`, which is
/// created.
/// @param error_text  of drives, for the faults; empty: they go by their codes
/// Errors: a log that cannot be read; logs of different robots; gnuplot is missing; the
/// folder cannot be written.
[[nodiscard]] Result<ReportFiles> make_report(const std::string& log,
                                              const std::vector<std::string>& others,
                                              const std::string& folder,
                                              const FindKernels& find_kernels,
                                              const ErrorText& error_text = {});

}  // namespace tandem::report
