// What is known before the log, and bodies that can exist.
#include "identification/estimate.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace tandem::identification {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kFreedom = 10.0;  // of a link's distribution: as many as its parameters
constexpr double kDelay_s = 0.005;

}  // namespace

Prior make_prior(const IdentifiedRobot& robot) {
  const Index links = robot.regressor.columns();
  const auto joints = static_cast<Index>(robot.facts.joint.size());
  const Index columns = links + kJointColumns * joints;
  Prior prior{VectorXd::Zero(columns), MatrixXd::Zero(columns, columns)};
  prior.mean.head(links) = robot.regressor.described();
  for (Index i = 0; i < links; i += 10) {
    const LinkParameters possible = made_possible(prior.mean.segment<10>(i));
    prior.mean.segment<10>(i) = possible;
    prior.metric.block<10, 10>(i, i) = natural_metric(possible);
  }
  for (Index c = 0; c < joints; ++c) {
    const auto k = static_cast<std::size_t>(c);
    const double torque = robot.facts.max_torque_Nm[k];
    const double rotor = robot.facts.rotor_kg_m2[k];
    const bool rigid = robot.facts.rigid[k];
    const double scale[] = {torque / robot.facts.max_velocity_rad_s[k], 0.3 * torque, 0.3 * torque,
                            rotor > 0.0 ? rotor : 1e-2, kDelay_s};
    for (Index i = 0; i < kJointColumns; ++i) {
      const Index at = links + kJointColumns * c + i;
      prior.metric(at, at) = 1.0 / (scale[i] * scale[i]);
    }
    if (rigid) prior.mean[links + kJointColumns * c + 3] = rotor;
  }
  return prior;
}

int lags_of(double n) { return static_cast<int>(std::lround(std::cbrt(n))); }

double quantile95(double n, int lags) {
  constexpr double kNormal = 1.959964;
  const double freedom = std::max(4.0, 0.75 * n / std::max(1, lags));
  return kNormal * (1.0 + (kNormal * kNormal + 1.0) / (4.0 * freedom));  // of Student's t
}

double long_run_variance(const VectorXd& residual, const std::vector<std::size_t>& instant,
                         int lags) {
  const Index n = residual.size();
  if (n == 0) return 0.0;
  double sum = residual.squaredNorm();
  for (int lag = 1; lag <= lags; ++lag) {
    double product = 0.0;
    for (Index i = lag; i < n; ++i) {
      const auto a = static_cast<std::size_t>(i);
      const auto b = static_cast<std::size_t>(i - lag);
      if (instant[a] - instant[b] != static_cast<std::size_t>(lag)) continue;  // a hole between
      product += residual[i] * residual[i - lag];
    }
    sum += 2.0 * (1.0 - lag / (lags + 1.0)) * product;
  }
  return std::max(sum, 0.1 * residual.squaredNorm()) / static_cast<double>(n);
}

namespace {

/// A minimum over possible bodies of x^T Q x / 2 - r^T x.
class PossibleBodies {
 public:
  PossibleBodies(const VectorXd& start, Index links)
      : links_(links), x_(start), coordinates_(start) {
    for (Index i = 0; i < links; i += 10)
      coordinates_.segment<10>(i) = log_cholesky(start.segment<10>(i));
  }
  [[nodiscard]] const VectorXd& parameters() const { return x_; }

  /// Levenberg and Marquardt: Gauss-Newton steps, shortened until the cost decreases.
  void minimise(const MatrixXd& Q, const VectorXd& r, int steps) {
    const auto cost = [&](const VectorXd& x) { return x.dot(0.5 * (Q * x) - r); };
    double now = cost(x_);
    double damping = 1e-6;
    for (int step = 0; step < steps; ++step) {
      MatrixXd J = MatrixXd::Identity(x_.size(), x_.size());
      for (Index i = 0; i < links_; i += 10) {
        Matrix10 block;
        x_.segment<10>(i) = from_log_cholesky(coordinates_.segment<10>(i), block);
        J.block<10, 10>(i, i) = block;
      }
      const MatrixXd A = J.transpose() * Q * J;
      const VectorXd gradient = J.transpose() * (Q * x_ - r);
      bool better = false;
      double gain = 0.0;
      for (int attempt = 0; attempt < 12 && !better; ++attempt) {
        MatrixXd damped = A;
        damped.diagonal() *= 1.0 + damping;
        const VectorXd next = coordinates_ - damped.ldlt().solve(gradient);
        VectorXd x = next;
        Matrix10 ignored;
        for (Index i = 0; i < links_; i += 10)
          x.segment<10>(i) = from_log_cholesky(next.segment<10>(i), ignored);
        const double then = cost(x);
        better = std::isfinite(then) && then <= now;
        damping = better ? std::max(1e-9, 0.2 * damping) : 10.0 * std::max(damping, 1e-6);
        if (!better) continue;
        gain = now - then;
        coordinates_ = next;
        x_ = x;
        now = then;
      }
      if (!better || gain < 1e-9 * (1.0 + std::abs(now))) return;
    }
  }

 private:
  Index links_;
  VectorXd x_, coordinates_;
};

}  // namespace

VectorXd possible_parameters(const DataEstimate& data, const Prior& prior, Index links) {
  PossibleBodies bodies(prior.mean, links);
  VectorXd weight = VectorXd::Constant(links / 10, kFreedom);
  for (const double width : {1.0, 1.0, 0.5, 0.3, 0.2, 0.1, 0.1, 0.05, 0.05, 0.03, 0.03, 0.03}) {
    MatrixXd metric = prior.metric;
    for (Index i = 0; i < links / 10; ++i) {
      const LinkParameters away =
          bodies.parameters().segment<10>(10 * i) - prior.mean.segment<10>(10 * i);
      const double distance = away.dot(prior.metric.block<10, 10>(10 * i, 10 * i) * away);
      weight[i] = kFreedom / (width * width + distance);
      metric.block<10, 10>(10 * i, 10 * i) *= weight[i];
    }
    bodies.minimise(data.information + metric, data.target + metric * prior.mean, 30);
  }
  return bodies.parameters();
}

}  // namespace tandem::identification
