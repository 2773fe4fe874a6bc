#include "estimation/site_wrenches.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <utility>

#include "base/nearest.hpp"
#include "estimation/robot_model.hpp"

namespace tandem::estimation {

Result<SiteWrenches> SiteWrenches::make(const tandem_kernels& kernels,
                                        const std::vector<std::string>& sites) {
  if (sites.size() > kMostWrenches) {
    return fail("wrenches at more than " + std::to_string(kMostWrenches) + " sites",
                "leave out those that nothing touches");
  }
  std::vector<std::size_t> found;
  for (const std::string& site : sites) {
    const int at = index_of(kernels.site_names, kernels.sites, site);
    if (at < 0) {
      return fail("the model of " + std::string(kernels.robot) + " has no site '" + site + "'",
                  suggest(site, std::vector<std::string>(kernels.site_names,
                                                         kernels.site_names + kernels.sites)));
    }
    if (std::ranges::find(found, static_cast<std::size_t>(at)) != found.end())
      return fail("the site '" + site + "' is there twice", "leave one out");
    found.push_back(static_cast<std::size_t>(at));
  }
  return SiteWrenches(kernels, std::move(found));
}

SiteWrenches::SiteWrenches(const tandem_kernels& kernels, std::vector<std::size_t> sites)
    : kernels_(&kernels),
      sites_(std::move(sites)),
      jacobians_(6 * kernels.sites * kernels.nv),
      f_(6 * sites_.size()) {}

void SiteWrenches::solve(const double* sines, const double* q,
                         std::span<const double> residual) noexcept TANDEM_RT {
  kernels_->site_jacobians_at(sines, q, jacobians_.data());
  static_assert(kMostWrenches == 4);
  switch (sites_.size()) {  // sizes that the compiler knows: a third of the time
    case 1: return solve_for<1>(residual);
    case 2: return solve_for<2>(residual);
    case 3: return solve_for<3>(residual);
    default: return solve_for<4>(residual);
  }
}

template <int kSites>
void SiteWrenches::solve_for(std::span<const double> residual) noexcept {
  constexpr double kDamping = 1e-4;  // against J J^T, m^2 and 1
  constexpr int kSize = 6 * kSites;
  using Vector = Eigen::Matrix<double, kSize, 1>;
  using Square = Eigen::Matrix<double, kSize, kSize>;
  const std::size_t nv = kernels_->nv;
  Square JJ = kDamping * Square::Identity();
  Vector Jr = Vector::Zero();
  double squares = 0.0;
  for (std::size_t j = kernels_->floating_base != 0 ? 6 : 0; j < nv; ++j) {
    squares += residual[j] * residual[j];
    Vector J;
    for (int i = 0; i < kSites; ++i) {
      const double* at = jacobians_.data() + 6 * nv * sites_[static_cast<std::size_t>(i)] + j;
      for (int row = 0; row < 6; ++row) J[6 * i + row] = at[static_cast<std::size_t>(row) * nv];
    }
    if (J.isZero(0.0)) continue;  // the joint moves no site
    JJ.noalias() += J * J.transpose();
    Jr += J * residual[j];
  }
  const Vector f = JJ.llt().solve(Jr);
  std::copy_n(f.data(), kSize, f_.data());
  // |r - J^T f|^2, as (J J^T + damping) f = J r.
  const double left = squares - f.dot(Jr) - kDamping * f.squaredNorm();
  unexplained_Nm_ = std::sqrt(std::max(0.0, left));
}

}  // namespace tandem::estimation
