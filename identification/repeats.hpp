// Motions that come again, and errors that come again with them.
// Layer: identification.  Thread: non-RT only.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "identification/recording.hpp"

namespace tandem::identification {

/// After how long a motion repeats itself: to a hundredth of the positions' variance, twice
/// at least, beside rests. Errors that depend on the motion (quantised torques, friction, whatever
/// the equations lack) are then the same in every period.
///
/// @param position  per joint; NaN where nothing is known
/// @param period_s  between two samples
/// @param stride    the answer's step, in samples
/// @return [s]; 0: it does not
[[nodiscard]] double motion_period_s(const std::vector<Signal>& position, double period_s,
                                     std::size_t stride);

/// How many times the long-run variance of a log's residuals is larger than it looks within one
/// period, because they come again: 1 for errors that are new in every period, the number of
/// periods for those that are always the same.
///
/// @param residual  a value per time of `time_s`, which are multiples of `stride_s` apart
/// @param lags      of Bartlett's window
[[nodiscard]] double repeat_factor(const Eigen::VectorXd& residual,
                                   const std::vector<double>& time_s, double period_s,
                                   double stride_s, int lags);

}  // namespace tandem::identification
