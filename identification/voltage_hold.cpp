#include "identification/voltage_hold.hpp"

#include <Eigen/LU>

namespace tandem::identification {

Eigen::VectorXd VoltageHold::sampled(const Eigen::MatrixXd& M, const Eigen::VectorXd& damping,
                                     const Eigen::VectorXd& mean) const {
  const Eigen::Index n = M.rows();
  const Eigen::MatrixXd unit = Eigen::MatrixXd::Identity(n, n);
  const Eigen::MatrixXd A = M.partialPivLu().solve(Eigen::MatrixXd(damping.asDiagonal()));
  const Eigen::MatrixXd hA = seconds / steps * A;
  Eigen::MatrixXd before = unit, last = unit - hA, sum = 0.5 * unit;
  for (int k = 1; k < steps; ++k) {
    sum += last;
    const Eigen::MatrixXd next = last - hA * (1.5 * last - 0.5 * before);
    before = last;
    last = next;
  }
  sum += 0.5 * last;
  return static_cast<double>(steps) * (last * sum.partialPivLu().solve(mean));
}

}  // namespace tandem::identification
