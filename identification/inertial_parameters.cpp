// Conversions between the ten numbers, the pseudo-inertia and its Cholesky factor.
#include "identification/inertial_parameters.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace tandem::identification {
namespace {

using Eigen::Matrix3d;
using Eigen::Matrix4d;
using Eigen::Vector3d;

constexpr double kThinnest = 1e-3;  // second moment, of the largest
constexpr double kPoint_m = 1e-3;   // radius of gyration

Matrix3d inertia_matrix(const LinkParameters& p) {
  Matrix3d I;
  I << p[4], p[5], p[6], p[5], p[7], p[8], p[6], p[8], p[9];
  return I;
}

LinkParameters assembled(double mass, const Vector3d& h, const Matrix3d& I) {
  LinkParameters p;
  p << mass, h, I(0, 0), I(0, 1), I(0, 2), I(1, 1), I(1, 2), I(2, 2);
  return p;
}

/// Where the entries of L stand: the diagonal, then what is below it.
constexpr std::array<std::array<int, 2>, 10> kEntries{
    {{0, 0}, {1, 1}, {2, 2}, {3, 3}, {1, 0}, {2, 0}, {2, 1}, {3, 0}, {3, 1}, {3, 2}}};

}  // namespace

LinkParameters parameters_of(const model::Inertia& inertia) {
  const Vector3d& c = inertia.com_m;
  const Matrix3d steiner = c.dot(c) * Matrix3d::Identity() - c * c.transpose();
  return assembled(inertia.mass_kg, inertia.mass_kg * c,
                   inertia.about_com_kg_m2 + inertia.mass_kg * steiner);
}

model::Inertia inertia_of(const LinkParameters& p) {
  const Vector3d c = p.segment<3>(1) / p[0];
  const Matrix3d steiner = c.dot(c) * Matrix3d::Identity() - c * c.transpose();
  return {p[0], c, inertia_matrix(p) - p[0] * steiner};
}

Matrix4d pseudo_inertia(const LinkParameters& p) {
  const Matrix3d I = inertia_matrix(p);
  Matrix4d P;
  P.topLeftCorner<3, 3>() = 0.5 * I.trace() * Matrix3d::Identity() - I;
  P.topRightCorner<3, 1>() = p.segment<3>(1);
  P.bottomLeftCorner<1, 3>() = p.segment<3>(1).transpose();
  P(3, 3) = p[0];
  return P;
}

LinkParameters parameters_of(const Matrix4d& P) {
  const Matrix3d S = P.topLeftCorner<3, 3>();
  return assembled(P(3, 3), P.topRightCorner<3, 1>(), S.trace() * Matrix3d::Identity() - S);
}

LinkParameters made_possible(const LinkParameters& p) {
  model::Inertia inertia = inertia_of(p);
  const Matrix3d& I = inertia.about_com_kg_m2;
  const Matrix3d S = 0.5 * I.trace() * Matrix3d::Identity() - I;
  const Eigen::SelfAdjointEigenSolver<Matrix3d> solver(S);
  const double floor =
      std::max(kThinnest * solver.eigenvalues()[2], inertia.mass_kg * kPoint_m * kPoint_m);
  if (solver.eigenvalues()[0] >= floor) return p;
  const Vector3d raised = solver.eigenvalues().cwiseMax(floor);
  const Matrix3d fit =
      solver.eigenvectors() * raised.asDiagonal() * solver.eigenvectors().transpose();
  inertia.about_com_kg_m2 = fit.trace() * Matrix3d::Identity() - fit;
  return parameters_of(inertia);
}

Matrix10 natural_metric(const LinkParameters& at) {
  const Eigen::LLT<Matrix4d> factor(pseudo_inertia(at));
  Eigen::Matrix<double, 16, 10> map;
  for (int k = 0; k < 10; ++k) {
    Matrix4d turned = factor.matrixL().solve(pseudo_inertia(LinkParameters::Unit(k)));
    turned = factor.matrixL().solve(turned.transpose().eval());
    map.col(k) = Eigen::Map<const Eigen::Matrix<double, 16, 1>>(turned.data());
  }
  return map.transpose() * map;
}

LinkParameters log_cholesky(const LinkParameters& possible) {
  const Matrix4d L = pseudo_inertia(possible).llt().matrixL();
  LinkParameters coordinates;
  for (int k = 0; k < 10; ++k) {
    const double entry = L(kEntries[k][0], kEntries[k][1]);
    coordinates[k] = k < 4 ? std::log(entry) : entry;
  }
  return coordinates;
}

LinkParameters from_log_cholesky(const LinkParameters& coordinates, Matrix10& derivative) {
  Matrix4d L = Matrix4d::Zero();
  for (int k = 0; k < 10; ++k)
    L(kEntries[k][0], kEntries[k][1]) = k < 4 ? std::exp(coordinates[k]) : coordinates[k];
  for (int k = 0; k < 10; ++k) {
    const auto [row, column] = kEntries[k];
    Matrix4d dL = Matrix4d::Zero();
    dL(row, column) = k < 4 ? L(row, column) : 1.0;
    const Matrix4d half = dL * L.transpose();
    derivative.col(k) = parameters_of(Matrix4d(half + half.transpose()));
  }
  return parameters_of(Matrix4d(L * L.transpose()));
}

}  // namespace tandem::identification
