// Solves S x = b for symmetric positive semidefinite S of any rank: constraints of a planar loop
// in space repeat each other, and such equations must not blow up. Fixed size, no allocation.
// Layer: model.  Thread: create non-RT; the rest any.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "base/realtime.hpp"

namespace tandem::model {

/// Cholesky factorisation with diagonal pivoting, cut off where the pivots fall below 1e-10 of
/// the largest (Higham, Accuracy and Stability of Numerical Algorithms, 2nd ed., section 10.3).
class SemidefiniteSolver {
 public:
  explicit SemidefiniteSolver(std::size_t most = 0) : L_(most * most), y_(most), order_(most) {}

  /// @param S  (n*n) row-major, of which the lower triangle is read; n at most the size created
  void factorise(std::span<const double> S, std::size_t n) noexcept TANDEM_RT;
  /// x over b. Where S is singular: the solution whose unknowns beyond rank() are 0.
  /// @pre b is consistent with S, or what is not is lost.
  void solve(std::span<double> b) noexcept TANDEM_RT;
  [[nodiscard]] std::size_t rank() const noexcept { return rank_; }

 private:
  double& at(std::size_t i, std::size_t j) noexcept { return L_[i * n_ + j]; }
  void exchange(std::size_t k, std::size_t p) noexcept;

  std::vector<double> L_, y_;
  std::vector<std::size_t> order_;
  std::size_t n_ = 0, rank_ = 0;
};

}  // namespace tandem::model
