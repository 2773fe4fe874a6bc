// Cholesky's factorisation in place, of fixed size and without heap.
// Layer: hal/sim.  Thread: any.
#pragma once

#include <cmath>
#include <vector>

#include "base/realtime.hpp"

namespace tandem::sim {

/// M = L L^T in the lower triangle. @param M  (n*n) symmetric, positive definite
inline void cholesky(std::vector<double>& M, std::size_t n) noexcept TANDEM_RT {
  for (std::size_t k = 0; k < n; ++k) {
    for (std::size_t j = 0; j < k; ++j)
      for (std::size_t i = k; i < n; ++i) M[i * n + k] -= M[i * n + j] * M[k * n + j];
    const double root = std::sqrt(M[k * n + k]);
    for (std::size_t i = k; i < n; ++i) M[i * n + k] /= root;
  }
}

/// x over b, of L L^T x = b. @param L  cholesky()'s
inline void solve_cholesky(const std::vector<double>& L, std::size_t n,
                           double* b) noexcept TANDEM_RT {
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = 0; j < i; ++j) b[i] -= L[i * n + j] * b[j];
    b[i] /= L[i * n + i];
  }
  for (std::size_t i = n; i-- > 0;) {
    for (std::size_t j = i + 1; j < n; ++j) b[i] -= L[j * n + i] * b[j];
    b[i] /= L[i * n + i];
  }
}

}  // namespace tandem::sim
