// Cholesky with diagonal pivoting, cut off at 1e-10 of the largest diagonal entry; unknowns beyond
// the rank are 0.
#include "model/semidefinite.hpp"

#include <algorithm>
#include <cmath>

namespace tandem::model {
namespace {

constexpr double kSmallestPivot = 1e-10;  // of the largest

}  // namespace

void SemidefiniteSolver::exchange(std::size_t k, std::size_t p) noexcept {
  if (k == p) return;
  for (std::size_t j = 0; j < n_; ++j) std::swap(at(k, j), at(p, j));
  for (std::size_t i = 0; i < n_; ++i) std::swap(at(i, k), at(i, p));
  std::swap(order_[k], order_[p]);
}

void SemidefiniteSolver::factorise(std::span<const double> S, std::size_t n) noexcept TANDEM_RT {
  n_ = n;
  for (std::size_t i = 0; i < n; ++i) {
    order_[i] = i;
    for (std::size_t j = 0; j <= i; ++j) at(i, j) = at(j, i) = S[i * n + j];
  }
  double largest = 0.0;
  for (std::size_t i = 0; i < n; ++i) largest = std::max(largest, at(i, i));
  for (rank_ = 0; rank_ < n; ++rank_) {
    const std::size_t k = rank_;
    std::size_t pivot = k;
    for (std::size_t i = k + 1; i < n; ++i)
      if (at(i, i) > at(pivot, pivot)) pivot = i;
    if (!(at(pivot, pivot) > kSmallestPivot * largest)) return;
    exchange(k, pivot);
    const double root = std::sqrt(at(k, k));
    at(k, k) = root;
    for (std::size_t i = k + 1; i < n; ++i) at(i, k) /= root;
    for (std::size_t i = k + 1; i < n; ++i)
      for (std::size_t j = k + 1; j <= i; ++j) at(j, i) = at(i, j) -= at(i, k) * at(j, k);
  }
}

void SemidefiniteSolver::solve(std::span<double> b) noexcept TANDEM_RT {
  for (std::size_t i = 0; i < rank_; ++i) {
    double sum = b[order_[i]];
    for (std::size_t j = 0; j < i; ++j) sum -= at(i, j) * y_[j];
    y_[i] = sum / at(i, i);
  }
  for (std::size_t i = rank_; i-- > 0;) {
    for (std::size_t j = i + 1; j < rank_; ++j) y_[i] -= at(j, i) * y_[j];
    y_[i] /= at(i, i);
  }
  for (std::size_t i = 0; i < n_; ++i) b[order_[i]] = i < rank_ ? y_[i] : 0.0;
}

}  // namespace tandem::model
