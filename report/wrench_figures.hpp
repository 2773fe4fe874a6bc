// The forces and moments that a run estimated at the places of its [[estimation.wrench]].
// Layer: report.  Thread: non-RT only.
#pragma once

#include <vector>

#include "base/result.hpp"
#include "report/figure.hpp"
#include "report/run_data.hpp"

namespace tandem::report {

/// Two figures of each place, "external_force_SITE" and "external_moment_SITE" (about the site's
/// origin): x, y, z in W, over the run's own rows. None where nothing was declared.
/// Errors: as log::LogFile::open() and read(), of a log that changed since the run was read.
[[nodiscard]] Result<std::vector<Figure>> wrench_figures(const RunData& run);

}  // namespace tandem::report
