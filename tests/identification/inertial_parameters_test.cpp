// Conversions of a link's ten parameters, and what of them a body can have.
#include "identification/inertial_parameters.hpp"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <random>

namespace tandem::identification {
namespace {

/// Some random point masses: a body that can exist.
LinkParameters random_body(std::mt19937_64& random, Eigen::Matrix4d* moments = nullptr) {
  std::uniform_real_distribution<double> place(-0.3, 0.3), mass(0.05, 1.0);
  Eigen::Matrix4d P = Eigen::Matrix4d::Zero();
  for (int i = 0; i < 8; ++i) {
    const Eigen::Vector4d r(place(random), place(random), place(random), 1.0);
    P += mass(random) * r * r.transpose();
  }
  if (moments != nullptr) *moments = P;
  return parameters_of(P);
}

TEST(InertialParameters, OfPointMassesAreTheirSums) {
  std::mt19937_64 random(3);
  for (int i = 0; i < 50; ++i) {
    Eigen::Matrix4d sum;
    const LinkParameters p = random_body(random, &sum);
    EXPECT_LT((pseudo_inertia(p) - sum).norm(), 1e-13);
    EXPECT_LT((parameters_of(inertia_of(p)) - p).norm(), 1e-12);
    const model::Inertia inertia = inertia_of(p);  // its own convention: about the center of mass
    EXPECT_GT(inertia.mass_kg, 0.0);
    EXPECT_NEAR(inertia.about_com_kg_m2.trace(),
                p[4] + p[7] + p[9] - 2.0 * p[0] * inertia.com_m.squaredNorm(), 1e-12);
  }
}

TEST(InertialParameters, LogCholeskyGivesPossibleBodiesOnlyAndBack) {
  std::mt19937_64 random(4);
  std::normal_distribution<double> any(0.0, 2.0);
  for (int i = 0; i < 50; ++i) {
    const LinkParameters p = random_body(random);
    Matrix10 derivative;
    EXPECT_LT((from_log_cholesky(log_cholesky(p), derivative) - p).norm(), 1e-12);
    LinkParameters x;
    for (double& one : x) one = any(random);
    const LinkParameters body = from_log_cholesky(x, derivative);
    EXPECT_GT(Eigen::SelfAdjointEigenSolver<Eigen::Matrix4d>(pseudo_inertia(body)).eigenvalues()[0],
              0.0);
    for (int k = 0; k < 10; ++k) {
      LinkParameters more = x, less = x;
      Matrix10 ignored;
      more[k] += 1e-6;
      less[k] -= 1e-6;
      const LinkParameters slope =
          (from_log_cholesky(more, ignored) - from_log_cholesky(less, ignored)) / 2e-6;
      EXPECT_LT((slope - derivative.col(k)).norm(), 1e-6 * (1.0 + slope.norm()));
    }
  }
}

TEST(InertialParameters, TheMetricDependsOnNoFrameAndNoUnit) {
  std::mt19937_64 random(5);
  for (int i = 0; i < 20; ++i) {
    Eigen::Matrix4d P, Q;
    const LinkParameters p = random_body(random, &P);
    const LinkParameters q = random_body(random, &Q);
    const double squared = (q - p).dot(natural_metric(p) * (q - p));
    Eigen::Matrix4d T = Eigen::Matrix4d::Random();
    T.row(3) << 0.0, 0.0, 0.0, 1.0;  // another frame, in other units
    const LinkParameters p2 = parameters_of(Eigen::Matrix4d(T * P * T.transpose()));
    const LinkParameters q2 = parameters_of(Eigen::Matrix4d(T * Q * T.transpose()));
    EXPECT_NEAR((q2 - p2).dot(natural_metric(p2) * (q2 - p2)), squared, 1e-6 * squared);
    EXPECT_NEAR((0.1 * p).dot(natural_metric(p) * (0.1 * p)), 0.04, 1e-9);
  }
}

TEST(InertialParameters, ImpossibleBodiesAreRaisedAndPossibleOnesStay) {
  std::mt19937_64 random(6);
  const LinkParameters p = random_body(random);
  EXPECT_EQ(made_possible(p), p);
  const model::Inertia rod{1.0, {0.1, 0.0, 0.0}, Eigen::Vector3d(0.0, 0.01, 0.01).asDiagonal()};
  const model::Inertia point{0.3, {0.0, 0.0, 0.1}, Eigen::Matrix3d::Zero()};
  for (const model::Inertia& thin : {rod, point}) {
    const LinkParameters raised = made_possible(parameters_of(thin));
    EXPECT_GT(
        Eigen::SelfAdjointEigenSolver<Eigen::Matrix4d>(pseudo_inertia(raised)).eigenvalues()[0],
        0.0);
    EXPECT_DOUBLE_EQ(raised[0], thin.mass_kg);
    EXPECT_LT((inertia_of(raised).com_m - thin.com_m).norm(), 1e-12);
    EXPECT_LT((inertia_of(raised).about_com_kg_m2 - thin.about_com_kg_m2).norm(), 1e-4);
  }
}

}  // namespace
}  // namespace tandem::identification
