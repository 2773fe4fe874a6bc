#include "identification/answer.hpp"

#include <Eigen/Cholesky>
#include <cmath>

#include "identification/estimate.hpp"

namespace tandem::identification {
namespace {

constexpr std::size_t kFewest = 60;
constexpr double kSlowest_rad_s = 0.01;  // RMS

}  // namespace

bool known(double value, double ci95, double scale) {
  return ci95 <= std::max(0.3 * std::abs(value), 0.02 * scale);
}

MotorEstimate estimate_motor(const std::vector<MotorInstant>& instants, bool rigid,
                             const Eigen::Vector4d& scales) {
  const auto n = static_cast<Eigen::Index>(instants.size());
  MotorEstimate out;
  if (instants.size() < kFewest) return out;
  Eigen::MatrixXd X(n, 5);
  Eigen::VectorXd y(n);
  std::vector<std::size_t> order;
  for (Eigen::Index i = 0; i < n; ++i) {
    const MotorInstant& at = instants[static_cast<std::size_t>(i)];
    X.row(i) << at.acceleration, at.velocity, at.direction, 1.0, -at.drive_rate;
    y[i] = at.drive - at.torque;
    order.push_back(static_cast<std::size_t>(i));
  }
  const double speed = X.col(1).norm() / std::sqrt(static_cast<double>(n));
  if (!(X.leftCols(4).allFinite() && speed > kSlowest_rad_s)) return out;
  if (y.isZero(1e-9)) return out;  // the torque is computed from the current: nothing to learn
  Eigen::VectorXd scale(5);
  scale << scales, 0.005;
  const Eigen::MatrixXd scaled = X * scale.asDiagonal();
  const int lags = lags_of(static_cast<double>(n));
  const double quantile = quantile95(static_cast<double>(n), lags);
  double noise = std::max(1e-12, y.squaredNorm() / static_cast<double>(n));
  Eigen::VectorXd z;
  Eigen::MatrixXd covariance;
  for (int round = 0; round < 3; ++round) {
    Eigen::MatrixXd A = scaled.transpose() * scaled / noise;
    A.diagonal().array() += 1e-2;
    const Eigen::LDLT<Eigen::MatrixXd> solver(A);
    z = solver.solve(scaled.transpose() * y / noise);
    covariance = solver.solve(Eigen::MatrixXd::Identity(5, 5));
    noise = std::max(1e-14, long_run_variance(y - scaled * z, order, lags) *
                                static_cast<double>(n) / static_cast<double>(n - 5));
  }
  const auto estimate = [&](Eigen::Index k) {
    Estimate one{z[k] * scale[k], quantile * scale[k] * std::sqrt(covariance(k, k)), false};
    one.identifiable = known(one.value, one.ci95, scale[k]);
    return one;
  };
  if (!rigid) out.rotor_kg_m2 = estimate(0);
  out.viscous_Nms_rad = estimate(1);
  out.coulomb_Nm = estimate(2);
  out.offset_Nm = estimate(3);
  return out;
}

}  // namespace tandem::identification
