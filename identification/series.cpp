#include "identification/series.hpp"

#include <cmath>
#include <numbers>

#include "base/split_mix.hpp"

namespace tandem::identification {
namespace {

double uniform(std::uint64_t& seed) {
  return static_cast<double>(split_mix(seed) >> 11) * 0x1.0p-52 - 1.0;
}

}  // namespace

ExcitingSeries::State ExcitingSeries::at(double t_s) const {
  State state{start, Eigen::VectorXd::Zero(start.size()), Eigen::VectorXd::Zero(start.size())};
  const double w = 2.0 * std::numbers::pi / period_s;
  for (Eigen::Index k = 0; k < a.rows(); ++k) {
    const double kw = w * static_cast<double>(k + 1);
    const double c = std::cos(kw * t_s);
    const double s = std::sin(kw * t_s);
    state.x += a.row(k).transpose() * (c - 1.0) + b.row(k).transpose() * s;
    state.v += kw * (b.row(k).transpose() * c - a.row(k).transpose() * s);
    state.acceleration -= kw * kw * (a.row(k).transpose() * c + b.row(k).transpose() * s);
  }
  return state;
}

void ExcitingSeries::rest_at_the_ends() {
  Eigen::VectorXd k = Eigen::VectorXd::LinSpaced(a.rows(), 1.0, static_cast<double>(a.rows()));
  b -= k * (k.transpose() * b) / k.squaredNorm();
  k = k.cwiseAbs2().eval();
  a -= k * (k.transpose() * a) / k.squaredNorm();
}

ExcitingSeries random_series(const Eigen::VectorXd& start, int harmonics, double period_s,
                             std::uint64_t& seed) {
  ExcitingSeries series{period_s, start, Eigen::MatrixXd(harmonics, start.size()),
                        Eigen::MatrixXd(harmonics, start.size())};
  for (Eigen::Index j = 0; j < start.size(); ++j) {
    for (Eigen::Index k = 0; k < harmonics; ++k) {
      series.a(k, j) = uniform(seed) / static_cast<double>(k + 1);
      series.b(k, j) = uniform(seed) / static_cast<double>(k + 1);
    }
  }
  series.rest_at_the_ends();
  return series;
}

ExcitingSeries series_through(const Eigen::MatrixXd& values, int harmonics, double period_s) {
  const Eigen::Index n = values.rows();
  ExcitingSeries series{period_s, values.row(0).transpose(),
                        Eigen::MatrixXd(harmonics, values.cols()),
                        Eigen::MatrixXd(harmonics, values.cols())};
  for (Eigen::Index k = 0; k < harmonics; ++k) {
    Eigen::VectorXd c(n), s(n);
    for (Eigen::Index i = 0; i < n; ++i) {
      const double angle =
          2.0 * std::numbers::pi * static_cast<double>((k + 1) * i % n) / static_cast<double>(n);
      c[i] = std::cos(angle);
      s[i] = std::sin(angle);
    }
    series.a.row(k) = 2.0 / static_cast<double>(n) * (c.transpose() * values);
    series.b.row(k) = 2.0 / static_cast<double>(n) * (s.transpose() * values);
  }
  series.rest_at_the_ends();
  return series;
}

}  // namespace tandem::identification
