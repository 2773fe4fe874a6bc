#include "identification/voltage_hold.hpp"

#include <Eigen/LU>

namespace tandem::identification {

Eigen::VectorXd VoltageHold::sampled(const Eigen::MatrixXd& M, const Eigen::VectorXd& damping,
                                     const Eigen::VectorXd& mean) const {
  const Eigen::Index n = M.rows();
  const Eigen::MatrixXd unit = Eigen::MatrixXd::Identity(n, n);
  const Eigen::MatrixXd A = M.partialPivLu().solve(Eigen::MatrixXd(damping.asDiagonal()));
  const Eigen::MatrixXd step = unit - seconds / steps * A;
  Eigen::MatrixXd last = unit, sum = Eigen::MatrixXd::Zero(n, n);
  for (int k = 0; k < steps; ++k) {
    sum += last;
    last = step * last;
  }
  return static_cast<double>(steps) * (last * sum.partialPivLu().solve(mean));
}

}  // namespace tandem::identification
