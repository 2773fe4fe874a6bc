// The torque that a robot's model says a logged run needed.
// Layer: report.  Thread: non-RT only.
#pragma once

#include "base/result.hpp"
#include "model/kernels.h"
#include "report/figure.hpp"
#include "report/run_data.hpp"

namespace tandem::report {

/// The torque [Nm] of one joint by inverse dynamics of the logged motion, as a curve over time,
/// with a NaN where samples are missing: nothing is differenced over a gap.
/// The ground's forces are those that the feet's sensors measured; feet without one take them from
/// the log's truth. The forces in closed loops are those that leave no torque at passive joints.
///
/// @param joint  in the image
/// Errors: what the log lacks (a passive joint's or the base's motion, the ground's forces);
/// closed loops beside force sensors.
[[nodiscard]] Result<Curve> inverse_dynamics_curve(const RunData& run, int joint,
                                                   const tandem_kernels& kernels);

}  // namespace tandem::report
