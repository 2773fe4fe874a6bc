// What the head of a report says of each log where there are several.
// Layer: report.  Thread: non-RT only.
#pragma once

#include "report/page.hpp"
#include "report/run_data.hpp"

namespace tandem::report {

/// File, experiment, when, how long, seed, versions, and in what the run is set up otherwise than
/// `first`.
[[nodiscard]] Facts head_facts(const RunData& run, const RunData& first);

}  // namespace tandem::report
