// Which wrench at one place would explain the external torques.
// Layer: estimation.  Thread: made non-RT; solve() RT.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "base/realtime.hpp"
#include "base/result.hpp"
#include "model/kernels.h"

namespace tandem::estimation {

/// Least squares of J^T f = r, damped where the posture cannot tell directions apart: what is not
/// observable there comes out as 0. It holds if nothing else touches the robot.
class SiteWrench {
 public:
  /// Errors: no such site (the nearest is named).
  [[nodiscard]] static Result<SiteWrench> make(const tandem_kernels& kernels,
                                               const std::string& site);

  /// @param q         of the kernels
  /// @param residual  (nv) MomentumObserver::residual()
  /// @return force [N] and moment [Nm] on the robot about the site's origin, in W's axes
  [[nodiscard]] Eigen::Matrix<double, 6, 1> solve(
      const double* q, std::span<const double> residual) noexcept TANDEM_RT;

 private:
  SiteWrench(const tandem_kernels& kernels, std::size_t site)
      : kernels_(&kernels), site_(site), jacobians_(6 * kernels.sites * kernels.nv) {}

  const tandem_kernels* kernels_;
  std::size_t site_;
  std::vector<double> jacobians_;
};

}  // namespace tandem::estimation
