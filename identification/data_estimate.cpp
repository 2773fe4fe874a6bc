// Everything is quadratic in the parameters, so the rows are needed for residuals only.
#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "identification/estimate.hpp"
#include "identification/repeats.hpp"

namespace tandem::identification {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kFaint = 1e-2;  // weight of the description where the data decide alone
// Share of a channel's mean square: errors of model and timing, which no length of a log averages.
constexpr double kModelError = 3e-6;
constexpr double kLeast = 0.1;  // of a residual's mean square: its long-run variance
constexpr int kReweightings = 4;

/// Rows of one channel that are used, as matrices of their own.
struct Used {
  MatrixXd X;
  VectorXd y, doubt;
  std::vector<std::size_t> instant;
};

Used used_rows(const ChannelRows& rows, const std::vector<bool>& used, Index columns) {
  Used out;
  for (const std::size_t at : rows.instant)
    if (used[at]) out.instant.push_back(at);
  out.X.resize(static_cast<Index>(out.instant.size()), columns);
  out.y.resize(static_cast<Index>(out.instant.size()));
  out.doubt = VectorXd::Zero(out.y.size());
  Index to = 0;
  for (Index row = 0; row < rows.rows(); ++row) {
    if (!used[rows.instant[static_cast<std::size_t>(row)]]) continue;
    if (static_cast<std::size_t>(row) < rows.doubt.size())
      out.doubt[to] = rows.doubt[static_cast<std::size_t>(row)];
    out.X.row(to) = rows.X.row(row);
    out.y[to++] = rows.y[row];
  }
  return out;
}

/// X^T X and X^T y of the columns that a channel has anything in.
struct Normal {
  MatrixXd gram;
  VectorXd target;
};

Normal normal_of(const Used& rows) {
  Normal normal{MatrixXd::Zero(rows.X.cols(), rows.X.cols()), VectorXd::Zero(rows.X.cols())};
  if (rows.y.size() == 0) return normal;  // no log has this channel
  normal.gram.selfadjointView<Eigen::Lower>().rankUpdate(rows.X.transpose());
  normal.gram = MatrixXd(normal.gram.selfadjointView<Eigen::Lower>());
  normal.target = rows.X.transpose() * rows.y;
  return normal;
}

/// The weighted least squares of all channels, and what its result varies by.
class LeastSquares {
 public:
  LeastSquares(const Equations& equations, const std::vector<bool>& used, const Prior& prior)
      : equations_(equations), prior_(prior), unit_(prior.metric), columns_(equations.columns) {
    double total = 0.0;
    for (const ChannelRows& channel : equations.channels) {
      rows_.push_back(used_rows(channel, used, columns_));
      normals_.push_back(normal_of(rows_.back()));
      const auto n = static_cast<double>(std::max<Index>(1, rows_.back().y.size()));
      total += n;
      noise_.push_back(std::max(1e-4 * rows_.back().y.squaredNorm() / n, 1e-12));
    }
    inflated_.assign(rows_.size(), 1.0);
    repeats_.assign(rows_.size(), 1.0);
    const double mean = total / static_cast<double>(std::max<std::size_t>(1, rows_.size()));
    lags_ = lags_of(mean);
    quantile_ = quantile95(mean, lags_);
    for (const ChannelRows& channel : equations.sensor_noise)
      added_.push_back(used_rows(channel, used, columns_));
  }

  [[nodiscard]] double quantile() const { return quantile_; }

  /// In units of the prior everything is of the order of one.
  [[nodiscard]] MatrixXd scaled(const MatrixXd& A) const {
    const MatrixXd half = unit_.matrixL().solve(A);
    return unit_.matrixL().solve(half.transpose());
  }
  [[nodiscard]] MatrixXd in_units(const MatrixXd& A) const {
    const MatrixXd half = unit_.matrixU().solve(A);
    return unit_.matrixU().solve(half.transpose());
  }
  /// The inverse of scaled information, the description believed by `weight`.
  [[nodiscard]] MatrixXd covariance(const MatrixXd& information, double weight) const {
    MatrixXd A = scaled(information);
    A.diagonal().array() += weight;
    return in_units(A.ldlt().solve(MatrixXd::Identity(columns_, columns_)));
  }

  /// The parameters by information and target, the description believed by kFaint.
  [[nodiscard]] VectorXd solved(const MatrixXd& information, const VectorXd& target) const {
    MatrixXd A = scaled(information);
    A.diagonal().array() += kFaint;
    const VectorXd right = unit_.matrixL().solve(target - information * prior_.mean);
    return prior_.mean + unit_.matrixU().solve(A.ldlt().solve(right));
  }

  /// Sums over the channels, each over its noise.
  [[nodiscard]] Normal sums() const {
    Normal sum{MatrixXd::Zero(columns_, columns_), VectorXd::Zero(columns_)};
    for (std::size_t c = 0; c < rows_.size(); ++c) {
      sum.gram += normals_[c].gram / noise_[c];
      sum.target += normals_[c].target / noise_[c];
    }
    return sum;
  }

  /// Noise and freedom of every channel from its residuals.
  void weigh(const MatrixXd& information, const VectorXd& mean) {
    MatrixXd A = scaled(information);
    A.diagonal().array() += kFaint;
    const MatrixXd inverse = in_units(A.ldlt().solve(MatrixXd::Identity(columns_, columns_)));
    for (std::size_t c = 0; c < rows_.size(); ++c) {
      if (rows_[c].y.size() == 0) continue;
      const VectorXd residual = rows_[c].y - rows_[c].X * mean;
      const auto n = static_cast<double>(rows_[c].y.size());
      repeats_[c] = repeats(residual, rows_[c].instant);
      const double fresh = n / repeats_[c];  // errors that come again count once
      // A channel's share of the freedom that the fit has used up: of slow errors, which count up
      // to lags + 1 times in the long-run variance.
      const double spent = inverse.cwiseProduct(normals_[c].gram).sum() / noise_[c];
      inflated_[c] =
          repeats_[c] * fresh / std::max(0.2 * fresh, fresh - 0.5 * (lags_ + 1.0) * spent);
      noise_[c] =
          model_error(c) + long_run_variance(residual, rows_[c].instant, lags_) * inflated_[c];
    }
    count_freedom();
  }

  /// Without what the sensors' noise adds: noise in X makes information of nothing, and parameters
  /// too small (errors in variables). Its mean is known, and taken away.
  [[nodiscard]] Normal without_noise(const Normal& sum) const {
    Normal less = sum;
    for (std::size_t c = 0; c < added_.size(); ++c) {
      if (added_[c].y.size() == 0) continue;
      const MatrixXd half = added_[c].X / std::sqrt(noise_[c]);
      less.gram -= half.transpose() * half;
      less.target -= added_[c].X.transpose() * added_[c].y / noise_[c];
    }
    return less;
  }

  /// Covariance of the right side: one sensor's noise is in many channels at an instant, and a
  /// channel's may be another one in every log. The long-run covariance of the channels' residuals
  /// in each log says how they go together. What is doubted is one error in all rows.
  [[nodiscard]] MatrixXd scores(const VectorXd& mean) const {
    MatrixXd sum = MatrixXd::Zero(columns_, columns_);
    const std::size_t logs = equations_.first_of_log.size();
    for (std::size_t l = 0; l < logs; ++l) {
      const std::size_t begin = equations_.first_of_log[l];
      const std::size_t end =
          l + 1 < logs ? equations_.first_of_log[l + 1] : equations_.time_s.size();
      const MatrixXd half = weighted_half(mean, begin, end);
      MatrixXd Z(static_cast<Index>(end - begin), columns_);
      for (Index k = 0; k < half.cols(); ++k) {
        if (half.col(k).isZero(0.0)) continue;
        Z.setZero();
        for (std::size_t c = 0; c < rows_.size(); ++c) {
          const double factor = half(static_cast<Index>(c), k);
          for (std::size_t i = 0; factor != 0.0 && i < rows_[c].instant.size(); ++i) {
            const std::size_t at = rows_[c].instant[i];
            if (at < begin || at >= end) continue;
            Z.row(static_cast<Index>(at - begin)) += factor * rows_[c].X.row(static_cast<Index>(i));
          }
        }
        sum.selfadjointView<Eigen::Lower>().rankUpdate(Z.transpose());
      }
    }
    sum = MatrixXd(sum.selfadjointView<Eigen::Lower>());
    VectorXd doubt = VectorXd::Zero(columns_);
    for (std::size_t c = 0; c < rows_.size(); ++c)
      doubt += rows_[c].X.transpose() * rows_[c].doubt / noise_[c];
    return sum + doubt * doubt.transpose();
  }

 private:
  /// repeat_factor() of a channel, over all logs.
  [[nodiscard]] double repeats(const VectorXd& residual,
                               const std::vector<std::size_t>& instant) const {
    double sum = 0.0;
    const auto& logs = equations_.first_of_log;
    for (std::size_t l = 0, from = 0; l < logs.size(); ++l) {
      const std::size_t end = l + 1 < logs.size() ? logs[l + 1] : equations_.time_s.size();
      std::vector<double> time_s;
      const std::size_t begin = from;
      for (; from < instant.size() && instant[from] < end; ++from)
        time_s.push_back(equations_.time_s[instant[from]]);
      const double period_s = l < equations_.repeats_s.size() ? equations_.repeats_s[l] : 0.0;
      const auto n = static_cast<Index>(from - begin);
      double factor = 1.0;
      if (period_s > 0.0 && n > 1) {
        factor = repeat_factor(residual.segment(static_cast<Index>(begin), n), time_s, period_s,
                               equations_.stride_s, lags_of(period_s / equations_.stride_s));
      }
      sum += factor * static_cast<double>(n);
    }
    return sum / static_cast<double>(std::max<std::size_t>(1, instant.size()));
  }

  /// The standard deviations in an interval, by what the channels have on average.
  void count_freedom() {
    double total = 0.0;
    for (std::size_t c = 0; c < rows_.size(); ++c)
      total += static_cast<double>(std::max<Index>(1, rows_[c].y.size())) / repeats_[c];
    const double mean = total / static_cast<double>(std::max<std::size_t>(1, rows_.size()));
    quantile_ = quantile95(mean, lags_of(mean));
  }

  [[nodiscard]] double model_error(std::size_t c) const {
    const auto n = static_cast<double>(std::max<Index>(1, rows_[c].y.size()));
    return kModelError * rows_[c].y.squaredNorm() / n + 1e-14;
  }

  /// H with H H^T = W S W: S of the residuals at instants `begin` to `end`, W their weights.
  [[nodiscard]] MatrixXd weighted_half(const VectorXd& mean, std::size_t begin,
                                       std::size_t end) const {
    const auto channels = static_cast<Index>(rows_.size());
    MatrixXd R = MatrixXd::Zero(static_cast<Index>(end - begin), channels);
    VectorXd count = VectorXd::Zero(channels);
    for (std::size_t c = 0; c < rows_.size(); ++c) {
      if (rows_[c].y.size() == 0) continue;
      const VectorXd residual = rows_[c].y - rows_[c].X * mean;
      for (std::size_t i = 0; i < rows_[c].instant.size(); ++i) {
        const std::size_t at = rows_[c].instant[i];
        if (at < begin || at >= end) continue;
        R(static_cast<Index>(at - begin), static_cast<Index>(c)) = residual[static_cast<Index>(i)];
        count[static_cast<Index>(c)] += 1.0;
      }
    }
    MatrixXd S = long_run_covariance(R, lags_);
    VectorXd weight = VectorXd::Zero(channels);
    for (Index c = 0; c < channels; ++c) {
      if (count[c] == 0.0) continue;
      const auto k = static_cast<std::size_t>(c);
      weight[c] = std::sqrt(inflated_[k] / count[c]) / noise_[k];
      S(c, c) = std::max(S(c, c), kLeast * R.col(c).squaredNorm());
      S(c, c) += model_error(k) * count[c] / inflated_[k];
    }
    const Eigen::SelfAdjointEigenSolver<MatrixXd> solver(weight.asDiagonal() * S *
                                                         weight.asDiagonal());
    return solver.eigenvectors() * solver.eigenvalues().cwiseMax(0.0).cwiseSqrt().asDiagonal();
  }

  const Equations& equations_;
  const Prior& prior_;
  Eigen::LLT<MatrixXd> unit_;
  Index columns_;
  std::vector<Used> rows_, added_;
  std::vector<Normal> normals_;
  std::vector<double> noise_;
  std::vector<double> inflated_;  // by what a channel's long-run variance is larger than it looks
  std::vector<double> repeats_;   // of it: because errors come again with the motion
  int lags_ = 0;
  double quantile_ = 0.0;
};

}  // namespace

MatrixXd long_run_covariance(const MatrixXd& residuals, int lags) {
  const Index n = residuals.rows();
  MatrixXd sum = residuals.transpose() * residuals;
  for (Index lag = 1; lag <= std::min<Index>(lags, n - 1); ++lag) {
    const MatrixXd product = residuals.bottomRows(n - lag).transpose() * residuals.topRows(n - lag);
    const double weight = 1.0 - static_cast<double>(lag) / (static_cast<double>(lags) + 1.0);
    sum += weight * (product + product.transpose());
  }
  return sum;
}

DataEstimate estimate_from_data(const Equations& equations, const std::vector<bool>& used,
                                const Prior& prior, const BaseParameters& base) {
  LeastSquares squares(equations, used, prior);
  DataEstimate out;
  Normal sum = squares.sums();
  for (int round = 1; round < kReweightings; ++round) {
    squares.weigh(sum.gram, squares.solved(sum.gram, sum.target));
    sum = squares.sums();
  }
  // A p = b without the noise in A; b varies by B. That is information A B^-1 A, and A may even be
  // indefinite where noise is all there is.
  out.quantile = squares.quantile();
  const Normal less = squares.without_noise(sum);
  const VectorXd mean = squares.solved(less.gram, less.target);
  const Eigen::LLT<MatrixXd> spread(squares.scores(mean) + kFaint * prior.metric);
  out.information = less.gram * spread.solve(less.gram);
  out.information = 0.5 * (out.information + MatrixXd(out.information.transpose()));
  out.target = less.gram * spread.solve(less.target);
  out.mean = squares.solved(out.information, out.target);
  out.covariance = squares.covariance(out.information, kFaint);
  out.link_covariance = squares.covariance(out.information, kBelieved);
  MatrixXd gram(base.count(), base.count());
  for (Index i = 0; i < base.count(); ++i)
    for (Index k = 0; k < base.count(); ++k)
      gram(i, k) = sum.gram(base.independent[i], base.independent[k]);
  out.condition = condition_number(gram);
  return out;
}

}  // namespace tandem::identification
