// The torque that a model says a logged motion needed, beside which the measured one is laid.
// Layer: report.  Thread: non-RT only.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "model/kernels.h"

namespace tandem::report {

/// A motion sampled at a constant step, row after row.
struct SampledMotion {
  double step_s = 0.0;
  std::vector<std::vector<double>> q;        ///< rows of nq, model order
  std::vector<std::vector<double>> v;        ///< rows of nv
  std::vector<std::vector<double>> sensors;  ///< rows of 6 per kernel sensor: what was measured
  /// Rows of 6 per kernel wrench: what acted there, force and moment about the site's origin in W
  /// axes. Empty: nobody knows.
  std::vector<std::vector<double>> wrenches;
};

/// Whether the wrench at every wrench site can be known: a six-axis sensor sees it and no other,
/// or the motion has it. If not, inverse_dynamics() would be wrong by what acts there.
[[nodiscard]] bool wrenches_known(const tandem_kernels& kernels, const SampledMotion& motion);

/// tau (nv) of each row: inverse dynamics with the acceleration differenced from v. The wrench at
/// a wrench site is the one that explains what its six-axis sensor measured; at a site without a
/// sensor of its own it is the motion's, or none.
[[nodiscard]] std::vector<std::vector<double>> inverse_dynamics(const tandem_kernels& kernels,
                                                                const SampledMotion& motion);

/// Derivative of a signal with a constant step: the slope of the line fitted to `half` samples on
/// both sides, fewer at the ends (Savitzky and Golay, 1964: first order).
[[nodiscard]] std::vector<double> derivative(std::span<const double> values, double step_s,
                                             std::size_t half);

}  // namespace tandem::report
