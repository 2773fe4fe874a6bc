#include "estimation/site_wrench.hpp"

#include <Eigen/Cholesky>

#include "base/nearest.hpp"
#include "estimation/robot_model.hpp"

namespace tandem::estimation {

Result<SiteWrench> SiteWrench::make(const tandem_kernels& kernels, const std::string& site) {
  const int at = index_of(kernels.site_names, kernels.sites, site);
  if (at < 0) {
    return fail("the model of " + std::string(kernels.robot) + " has no site '" + site + "'",
                suggest(site, std::vector<std::string>(kernels.site_names,
                                                       kernels.site_names + kernels.sites)));
  }
  return SiteWrench(kernels, static_cast<std::size_t>(at));
}

Eigen::Matrix<double, 6, 1> SiteWrench::solve(const double* q,
                                              std::span<const double> residual) noexcept TANDEM_RT {
  constexpr double kDamping = 1e-4;  // against J J^T, m^2 and 1
  kernels_->site_jacobians(q, jacobians_.data());
  const double* J = jacobians_.data() + 6 * kernels_->nv * site_;
  Eigen::Matrix<double, 6, 6> JJ = kDamping * Eigen::Matrix<double, 6, 6>::Identity();
  Eigen::Matrix<double, 6, 1> Jr = Eigen::Matrix<double, 6, 1>::Zero();
  for (std::size_t k = 0; k < kernels_->nv; ++k) {
    Eigen::Matrix<double, 6, 1> column;
    for (std::size_t row = 0; row < 6; ++row)
      column[static_cast<int>(row)] = J[row * kernels_->nv + k];
    JJ.noalias() += column * column.transpose();
    Jr += column * residual[k];
  }
  return JJ.llt().solve(Jr);
}

}  // namespace tandem::estimation
