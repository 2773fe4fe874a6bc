// Column pivoting picks independent columns; the triangular factor says how the others depend.
#include "identification/base_parameters.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <limits>

#include "base/split_mix.hpp"

namespace tandem::identification {
namespace {

double uniform(std::uint64_t& seed, double extent) {
  const double unit = static_cast<double>(split_mix(seed) >> 11) * 0x1.0p-53;
  return extent * (2.0 * unit - 1.0);
}

Eigen::Vector3d random_vector(std::uint64_t& seed, double extent) {
  const double x = uniform(seed, extent);
  const double y = uniform(seed, extent);
  const double z = uniform(seed, extent);
  return {x, y, z};
}

}  // namespace

BaseParameters base_parameters_of(const Eigen::MatrixXd& X, double tolerance) {
  const Eigen::VectorXd norms = X.colwise().norm();
  const double longest = norms.size() > 0 ? norms.maxCoeff() : 0.0;
  std::vector<Eigen::Index> kept;
  for (Eigen::Index c = 0; c < X.cols(); ++c)
    if (norms[c] > tolerance * longest) kept.push_back(c);
  const auto n = static_cast<Eigen::Index>(kept.size());
  Eigen::MatrixXd scaled(X.rows(), n);
  for (Eigen::Index c = 0; c < n; ++c) scaled.col(c) = X.col(kept[c]) / norms[kept[c]];
  Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(scaled);
  qr.setThreshold(tolerance);
  const Eigen::Index rank = n > 0 ? qr.rank() : 0;
  const auto& order = qr.colsPermutation().indices();

  // W2 = W1 R1^-1 R2, so that W p = W1 (p1 + R1^-1 R2 p2).
  const Eigen::MatrixXd R = qr.matrixR().topRows(rank);
  const Eigen::MatrixXd dependence =
      R.leftCols(rank).triangularView<Eigen::Upper>().solve(R.rightCols(n - rank));
  std::vector<Eigen::Index> rows(static_cast<std::size_t>(rank));
  for (Eigen::Index i = 0; i < rank; ++i) rows[i] = i;
  std::ranges::sort(rows, {}, [&](Eigen::Index i) { return kept[order[i]]; });
  BaseParameters base;
  base.combination = Eigen::MatrixXd::Zero(rank, X.cols());
  for (Eigen::Index i = 0; i < rank; ++i) {
    const Eigen::Index from = rows[i];
    const Eigen::Index column = kept[order[from]];
    base.independent.push_back(column);
    base.combination(i, column) = 1.0;
    for (Eigen::Index k = 0; k < n - rank; ++k) {
      const Eigen::Index other = kept[order[rank + k]];
      const double factor = dependence(from, k);
      if (std::abs(factor) > 1e-7)
        base.combination(i, other) = factor * norms[other] / norms[column];
    }
  }
  return base;
}

Instant random_instant(const Regressor& regressor, const model::Tree& tree, std::size_t sensors,
                       std::uint64_t& seed) {
  const auto n = static_cast<Eigen::Index>(regressor.coordinates().size());
  Instant at;
  at.q.resize(n);
  at.v.resize(n);
  at.vdot.resize(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const int joint = tree.joint_index(regressor.coordinates()[static_cast<std::size_t>(i)]);
    const bool slides =
        tree.joints[static_cast<std::size_t>(joint)].type == model::JointType::kPrismatic;
    at.q[i] = uniform(seed, slides ? 0.3 : 1.0);
    at.v[i] = uniform(seed, 2.0);
    at.vdot[i] = uniform(seed, 5.0);
  }
  at.w.setZero();
  at.al.setZero();
  at.a = {0.0, 0.0, 9.81};
  if (tree.floating_base) {
    at.w = random_vector(seed, 2.0);
    at.al = random_vector(seed, 5.0);
    at.a = random_vector(seed, 10.0);
  }
  at.wrenches.assign(sensors, Eigen::Matrix<double, 6, 1>::Zero());
  return at;
}

Eigen::MatrixXd random_regressor(Regressor& regressor, const model::Tree& tree, int instants,
                                 std::uint64_t seed) {
  const auto channels = static_cast<Eigen::Index>(regressor.channels().size());
  const std::size_t sensors = regressor.sensor_count();
  Eigen::MatrixXd X(channels * instants, regressor.columns());
  Eigen::MatrixXd Y;
  Eigen::VectorXd known;
  for (int i = 0; i < instants; ++i) {
    regressor.evaluate(random_instant(regressor, tree, sensors, seed), Y, known);
    X.middleRows(channels * i, channels) = Y;
  }
  return X;
}

double condition_number(const Eigen::MatrixXd& gram) {
  if (gram.rows() == 0) return std::numeric_limits<double>::infinity();
  const Eigen::VectorXd lengths = gram.diagonal().cwiseSqrt();
  if (!(lengths.minCoeff() > 0.0)) return std::numeric_limits<double>::infinity();
  const Eigen::VectorXd inverse = lengths.cwiseInverse();
  const Eigen::MatrixXd scaled = inverse.asDiagonal() * gram * inverse.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(scaled, Eigen::EigenvaluesOnly);
  const double least = solver.eigenvalues()[0];
  const double most = solver.eigenvalues()[gram.rows() - 1];
  return least > 1e-15 * most ? std::sqrt(most / least) : std::numeric_limits<double>::infinity();
}

}  // namespace tandem::identification
