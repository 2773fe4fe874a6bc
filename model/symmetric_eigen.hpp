// Eigenvalues of symmetric matrices of any size.
// Layer: model.  Thread: non-RT.
#pragma once

#include <Eigen/Core>

namespace tandem::model {

/// @pre A is symmetric, n x n with n > 0; its lower triangle is read.
/// @return (n) ascending
[[nodiscard]] Eigen::VectorXd symmetric_eigenvalues(const Eigen::MatrixXd& A);

/// The same with eigenvectors of unit length: column i is that of value i.
struct SymmetricEigen {
  Eigen::VectorXd values;
  Eigen::MatrixXd vectors;
};
[[nodiscard]] SymmetricEigen symmetric_eigen(const Eigen::MatrixXd& A);

}  // namespace tandem::model
