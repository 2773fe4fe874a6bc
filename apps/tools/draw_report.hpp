// Draws the report of a log, for `tandem report` and for a run that ends with its report.
// Layer: apps/tools.  Thread: main.
#pragma once

#include <string>

#include "base/result.hpp"
#include "report/report.hpp"

namespace tandem::apps {

/// @param other   a second log, laid over the first; empty: none
/// @param output  folder to write; empty: beside `log`, named after the logs
/// Errors: report::make_report()'s.
[[nodiscard]] Result<report::ReportFiles> draw_report(const std::string& log,
                                                      const std::string& other,
                                                      const std::string& output);

}  // namespace tandem::apps
