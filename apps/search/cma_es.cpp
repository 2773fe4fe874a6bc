#include "apps/search/cma_es.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <utility>

#include "base/split_mix.hpp"

namespace tandem::apps {
namespace {

/// Folds a number into 0 to 1, as mirrors at both ends do.
double reflected(double x) {
  const double in_period = x - 2.0 * std::floor(x / 2.0);
  return in_period > 1.0 ? 2.0 - in_period : in_period;
}

std::size_t default_population(Eigen::Index n) {
  return 4 + static_cast<std::size_t>(3.0 * std::log(static_cast<double>(n)));
}

}  // namespace

CmaEs::CmaEs(Eigen::VectorXd mean, double sigma, std::uint64_t seed, std::size_t population)
    : n_(mean.size()),
      population_(population > 0 ? std::max<std::size_t>(population, 4) : default_population(n_)),
      random_(seed),
      mean_(std::move(mean)),
      p_sigma_(Eigen::VectorXd::Zero(n_)),
      p_c_(Eigen::VectorXd::Zero(n_)),
      sigma_(sigma),
      covariance_(Eigen::MatrixXd::Identity(n_, n_)) {
  const auto n = static_cast<double>(n_);
  const auto lambda = static_cast<Eigen::Index>(population_);
  weights_ = Eigen::VectorXd(lambda);
  for (Eigen::Index i = 0; i < lambda; ++i) {
    weights_[i] = std::log((static_cast<double>(lambda) + 1.0) / 2.0) -
                  std::log(static_cast<double>(i) + 1.0);
  }
  const auto good = weights_.head(lambda / 2);
  const auto bad = weights_.tail(lambda - lambda / 2);
  mu_eff_ = good.sum() * good.sum() / good.squaredNorm();
  const double mu_eff_bad = bad.sum() * bad.sum() / bad.squaredNorm();
  c_sigma_ = (mu_eff_ + 2.0) / (n + mu_eff_ + 5.0);
  d_sigma_ = 1.0 + 2.0 * std::max(0.0, std::sqrt((mu_eff_ - 1.0) / (n + 1.0)) - 1.0) + c_sigma_;
  c_c_ = (4.0 + mu_eff_ / n) / (n + 4.0 + 2.0 * mu_eff_ / n);
  c_1_ = 2.0 / ((n + 1.3) * (n + 1.3) + mu_eff_);
  c_mu_ = std::min(
      1.0 - c_1_, 2.0 * (0.25 + mu_eff_ + 1.0 / mu_eff_ - 2.0) / ((n + 2.0) * (n + 2.0) + mu_eff_));
  const double bad_share = std::min({1.0 + c_1_ / c_mu_, 1.0 + 2.0 * mu_eff_bad / (mu_eff_ + 2.0),
                                     (1.0 - c_1_ - c_mu_) / (n * c_mu_)});
  const double good_sum = weights_.cwiseMax(0.0).sum(), bad_sum = -weights_.cwiseMin(0.0).sum();
  for (double& w : weights_) w *= w >= 0.0 ? 1.0 / good_sum : bad_share / bad_sum;
  chi_ = std::sqrt(n) * (1.0 - 1.0 / (4.0 * n) + 1.0 / (21.0 * n * n));
  decompose();
}

/// Box and Muller, of which one number is used.
double CmaEs::normal() {
  const auto uniform = [this] { return static_cast<double>(split_mix(random_) >> 11) * 0x1p-53; };
  const double radius = std::sqrt(-2.0 * std::log(1.0 - uniform()));
  return radius * std::cos(2.0 * std::numbers::pi * uniform());
}

void CmaEs::decompose() {
  const Eigen::MatrixXd symmetric = (covariance_ + covariance_.transpose()) / 2.0;
  covariance_ = symmetric;
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(covariance_);
  axes_ = solver.eigenvectors();
  lengths_ = solver.eigenvalues().cwiseMax(1e-20).cwiseSqrt();
}

std::vector<Eigen::VectorXd> CmaEs::ask() {
  steps_.clear();
  std::vector<Eigen::VectorXd> points;
  for (std::size_t k = 0; k < population_; ++k) {
    Eigen::VectorXd z(n_);
    for (double& one : z) one = normal();
    steps_.emplace_back(axes_ * lengths_.cwiseProduct(z));
    points.emplace_back((mean_ + sigma_ * steps_.back()).unaryExpr(&reflected));
  }
  return points;
}

void CmaEs::tell(std::span<const double> values) {
  std::vector<std::size_t> order(population_);
  std::iota(order.begin(), order.end(), std::size_t{0});
  const auto rank = [&values](std::size_t i) {
    const bool none = std::isnan(values[i]);
    return std::pair(none, none ? 0.0 : values[i]);
  };
  std::ranges::stable_sort(order, {}, rank);
  flat_ = rank(order.front()) == rank(order.back()) ? flat_ + 1 : 0;
  // Nothing draws towards a point without a value, even where there are few others.
  const auto drawn = static_cast<Eigen::Index>(
      std::ranges::count_if(values, [](double one) { return !std::isnan(one); }));

  const auto lambda = static_cast<Eigen::Index>(population_);
  Eigen::VectorXd step = Eigen::VectorXd::Zero(n_);
  for (Eigen::Index i = 0; i < std::min(lambda / 2, drawn); ++i)
    step += weights_[i] * steps_[order[static_cast<std::size_t>(i)]];
  mean_ += sigma_ * step;

  const auto whitened = [this](const Eigen::VectorXd& y) -> Eigen::VectorXd {
    return axes_ * (axes_.transpose() * y).cwiseQuotient(lengths_);
  };
  p_sigma_ = (1.0 - c_sigma_) * p_sigma_ +
             std::sqrt(c_sigma_ * (2.0 - c_sigma_) * mu_eff_) * whitened(step);
  ++generations_;
  const double length = p_sigma_.norm();
  const double grown =
      std::sqrt(1.0 - std::pow(1.0 - c_sigma_, 2.0 * static_cast<double>(generations_)));
  const bool steady = length / grown < (1.4 + 2.0 / (static_cast<double>(n_) + 1.0)) * chi_;
  p_c_ *= 1.0 - c_c_;
  if (steady) p_c_ += std::sqrt(c_c_ * (2.0 - c_c_) * mu_eff_) * step;

  const double lost = steady ? 0.0 : c_c_ * (2.0 - c_c_);
  covariance_ *= 1.0 + c_1_ * lost - c_1_ - c_mu_ * weights_.sum();
  covariance_ += c_1_ * p_c_ * p_c_.transpose();
  for (Eigen::Index i = 0; i < lambda; ++i) {
    const Eigen::VectorXd& y = steps_[order[static_cast<std::size_t>(i)]];
    double weight = i >= drawn ? std::min(weights_[i], 0.0) : weights_[i];
    if (weight < 0.0)
      weight *= static_cast<double>(n_) / std::max(whitened(y).squaredNorm(), 1e-20);
    covariance_ += c_mu_ * weight * y * y.transpose();
  }
  // Beyond the cube's size a step says nothing more.
  sigma_ = std::min(sigma_ * std::exp(c_sigma_ / d_sigma_ * (length / chi_ - 1.0)), 1.0);
  decompose();
}

bool CmaEs::has_converged(double resolution) const {
  const std::size_t patience = 10 + 30 * static_cast<std::size_t>(n_) / population_;
  return sigma_ * lengths_.maxCoeff() < resolution || flat_ >= patience;
}

}  // namespace tandem::apps
