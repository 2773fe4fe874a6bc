// Where a closed loop's passive joints were in a run that nobody simulated: the log has no truth.
// Layer: report.  Thread: non-RT only.
#pragma once

#include "base/result.hpp"
#include "model/kernels.h"
#include "report/run_data.hpp"

namespace tandem::report {

/// Fills run.passive_rad with what closes the loops at the measured positions of the others, each
/// row from the one before it. Does nothing for a run that has it, or without passive joints.
/// Errors: loops that the measured positions do not let close (with the time); kernels of another
/// robot. Then passive_rad stays empty.
[[nodiscard]] Status close_passive(RunData& run, const tandem_kernels& kernels);

}  // namespace tandem::report
