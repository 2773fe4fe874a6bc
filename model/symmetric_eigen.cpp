// Eigen's solver, compiled once: it takes compilers longer than most of our sources.
#include "model/symmetric_eigen.hpp"

#include <Eigen/Eigenvalues>

namespace tandem::model {

namespace {
using Solver = Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>;
}

Eigen::VectorXd symmetric_eigenvalues(const Eigen::MatrixXd& A) {
  return Solver(A, Eigen::EigenvaluesOnly).eigenvalues();
}

SymmetricEigen symmetric_eigen(const Eigen::MatrixXd& A) {
  const Solver solver(A);
  return {solver.eigenvalues(), solver.eigenvectors()};
}

}  // namespace tandem::model
