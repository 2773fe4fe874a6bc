// The report of a run, or of two or three laid over each other. Start here.
// Layer: report.  Thread: non-RT only.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "model/kernels.h"
#include "report/run_data.hpp"

namespace tandem::report {

/// Finds the kernels of a run's robot; null when there are none that fit.
using FindKernels = std::function<const tandem_kernels*(const RunData&)>;

struct ReportFiles {
  std::string page;                  ///< report.html
  std::vector<std::string> images;   ///< PNG, one per figure, and the overview
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
