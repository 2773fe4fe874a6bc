// The solver of the squat's equations, against Eigen's.
#include "controllers/square_system.hpp"

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <Eigen/LU>
#include <cmath>
#include <random>

namespace tandem {
namespace {

using Eigen::Index;

/// A's solution for b, by the system.
Eigen::VectorXd solution(const Eigen::MatrixXd& A, const Eigen::VectorXd& b) {
  const auto n = static_cast<std::size_t>(A.rows());
  SquareSystem system(n);
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = 0; j < n; ++j) {
      system.row(i)[j] = A(static_cast<Index>(i), static_cast<Index>(j));
    }
  }
  std::vector<SquareSystem::Two> solved(n);
  for (std::size_t i = 0; i < n; ++i) system.set_right(i, {b[static_cast<Index>(i)], 0.0});
  system.solve(solved);
  Eigen::VectorXd x(A.rows());
  for (std::size_t i = 0; i < n; ++i) x[static_cast<Index>(i)] = solved[i][0];
  return x;
}

TEST(SquareSystem, IsSolvedAsByEigen) {
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  const auto number = [&] { return normal(random); };
  for (Index n = 1; n <= 24; ++n) {
    for (int round = 0; round < 20; ++round) {
      const Eigen::MatrixXd A = Eigen::MatrixXd::NullaryExpr(n, n, number);
      const Eigen::VectorXd b = Eigen::VectorXd::NullaryExpr(n, number);
      const Eigen::PartialPivLU<Eigen::MatrixXd> eigen(A);
      const double error = (solution(A, b) - eigen.solve(b)).cwiseAbs().maxCoeff();
      EXPECT_LT(error, 1e-13 * A.norm() * eigen.inverse().norm() * eigen.solve(b).norm()) << n;
    }
  }
}

TEST(SquareSystem, TakesPivotsFromOtherRowsAndLeavesOtherLimbsOut) {
  // Two limbs of 3 unknowns, whose first pivots are zero, and one equation that joins them.
  Eigen::MatrixXd A = Eigen::MatrixXd::Zero(7, 7);
  A.block<3, 3>(0, 0) << 0, 2, 1, 1, 0, 3, 4, 1, 0;
  A.block<3, 3>(3, 3) << 0, 0, 5, 0, 2, 1, 3, 1, 1;
  A.row(6).setConstant(1.0);
  const Eigen::VectorXd x = Eigen::VectorXd::LinSpaced(7, -3.0, 3.0);
  EXPECT_LT((solution(A, A * x) - x).norm(), 1e-14);
}

TEST(SquareSystem, HasTwoRightSidesAndIsWrittenAnew) {
  using Two = SquareSystem::Two;
  SquareSystem system(2);
  std::array<Two, 2> x{};
  for (const double scale : {1.0, 2.0}) {
    system.row(0)[0] = 0.0, system.row(0)[1] = scale;
    system.row(1)[0] = scale, system.row(1)[1] = 0.0;
    system.set_right(0, {3.0, -1.0});
    system.set_right(1, {4.0, 0.0});
    system.solve(x);
    EXPECT_EQ(x, (std::array{Two{4.0 / scale, 0.0}, Two{3.0 / scale, -1.0 / scale}}));
  }
}

TEST(SquareSystem, OfNothingHasNothingToSolve) {
  SquareSystem system;
  system.solve({});
  EXPECT_EQ(system.size(), 0U);
}

TEST(SquareSystem, ThatIsSingularHasNoFiniteSolution) {
  Eigen::MatrixXd A = Eigen::MatrixXd::Random(5, 5);
  A.row(3) = 2.0 * A.row(1);
  A.col(2).setZero();
  EXPECT_FALSE(solution(A, Eigen::VectorXd::Ones(5)).allFinite());
}

}  // namespace
}  // namespace tandem
