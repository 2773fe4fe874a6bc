// Draws the report of a log, for `tandem report` and for a run that ends with its report.
// Layer: apps/tools.  Thread: main.
#pragma once

#include <string>
#include <vector>

#include "base/result.hpp"
#include "model/kernel_library.hpp"
#include "report/report.hpp"

namespace tandem::apps {

/// Finds the kernels of a run's robot, which live as long as `kernels`.
[[nodiscard]] report::FindKernels kernels_into(model::KernelLibrary& kernels);

/// @param others  up to two more logs, laid over the first
/// @param output  folder to write; empty: beside `log`, named after the logs
/// @param interrupted  what is said when a signal ends the drawing; empty: that nothing was written
/// Errors: report::make_report()'s, which leave nothing half made.
[[nodiscard]] Result<report::ReportFiles> draw_report(const std::string& log,
                                                      const std::vector<std::string>& others,
                                                      const std::string& output,
                                                      const std::string& interrupted = {});

}  // namespace tandem::apps
