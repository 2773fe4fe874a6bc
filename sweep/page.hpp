// One page of a sweep, for a browser: self-contained, without scripts.
// Layer: sweep.  Thread: one at a time.
#pragma once

#include <string>

#include "base/result.hpp"
#include "sweep/results.hpp"
#include "sweep/study.hpp"
#include "sweep/summary.hpp"

namespace tandem::sweep {

/// Pass rates, variants compared, margins' distributions, margins over what varies, their ranks,
/// and the worst points with their commands. Errors: the file cannot be written.
[[nodiscard]] Status write_page(const std::string& path, const Study& study, const Points& points,
                                const std::vector<std::optional<PointResult>>& results,
                                const SweepSummary& summary);

}  // namespace tandem::sweep
