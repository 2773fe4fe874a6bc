// The torque that a model says a logged motion needed, beside which the measured one is laid.
// Layer: report.  Thread: non-RT only.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "model/kernels.h"

namespace tandem::report {

/// A motion sampled at a constant step, row after row.
struct Motion {
  double step_s = 0.0;
  std::vector<std::vector<double>> q;        ///< rows of nq, model order
  std::vector<std::vector<double>> v;        ///< rows of nv
  std::vector<std::vector<double>> sensors;  ///< rows of 6 per kernel sensor: what was measured
};

/// tau (nv) of each row: inverse dynamics with the acceleration differenced from v, and with
/// those wrenches at the wrench sites that explain what the six-axis sensors measured. A site
/// that no sensor sees, or that shares its sensor with another, carries no wrench.
[[nodiscard]] std::vector<std::vector<double>> inverse_dynamics(const tandem_kernels& kernels,
                                                                const Motion& motion);

/// Derivative of a signal with a constant step: the slope of the line fitted to `half` samples on
/// both sides, fewer at the ends (Savitzky and Golay, 1964: first order).
[[nodiscard]] std::vector<double> derivative(std::span<const double> values, double step_s,
                                             std::size_t half);

}  // namespace tandem::report
