// Figures and table of a robot and the one that was simulated beside it: first minus second.
// Layer: report.  Thread: non-RT only.
#pragma once

#include <vector>

#include "report/figure.hpp"
#include "report/page.hpp"
#include "report/run_data.hpp"

namespace tandem::report {

/// Position and torque differences of the joints where they are largest, and the difference of the
/// vertical force in the first six-axis sensor that is shown.
[[nodiscard]] std::vector<Figure> difference_figures(const RunData& run, const RunData& second);

/// Every joint's, the largest difference of torque first.
[[nodiscard]] PageTable differences_table(const RunData& run, const RunData& second);

}  // namespace tandem::report
