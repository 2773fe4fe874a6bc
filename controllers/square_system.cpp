// Rows stay where they are and their order is kept beside them; the factors of L too, so that a
// row's update may begin left of the pivot, at a whole vector.
#include "controllers/square_system.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace tandem {
namespace {

constexpr std::size_t kLanes = 2;  // of any x86-64

constexpr std::size_t whole_vectors(std::size_t size) noexcept {
  return (size + kLanes - 1) / kLanes * kLanes;
}

/// row -= factor * pivot_row for `count` elements, a multiple of kLanes.
inline void subtract(double factor, const double* __restrict pivot_row, double* __restrict row,
                     std::size_t count) noexcept {
  for (std::size_t j = 0; j < count; j += kLanes) {
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      row[j + lane] -= factor * pivot_row[j + lane];
    }
  }
}

inline void subtract(double factor, const std::array<double, 2>& from,
                     std::array<double, 2>& rest) noexcept {
  rest[0] -= factor * from[0];
  rest[1] -= factor * from[1];
}

void eliminate(std::size_t size, std::size_t stride, double* A, double* L, double* inverse,
               std::size_t* order) noexcept {
  for (std::size_t k = 0; k < size; ++k) {
    std::size_t best = k;
    double most = 0.0;
    for (std::size_t i = k; i < size; ++i) {
      const double magnitude = std::abs(A[order[i] * stride + k]);
      best = magnitude > most ? i : best;
      most = std::max(most, magnitude);
    }
    std::swap(order[k], order[best]);
    const double* pivot_row = A + order[k] * stride;
    inverse[k] = 1.0 / pivot_row[k];
    const std::size_t first = k / kLanes * kLanes;
    for (std::size_t i = k + 1; i < size; ++i) {
      double* row = A + order[i] * stride;
      const double factor = row[k] * inverse[k];
      L[order[i] * stride + k] = factor;
      if (factor == 0.0) continue;  // of another limb
      subtract(factor, pivot_row + first, row + first, stride - first);
    }
  }
}

}  // namespace

SquareSystem::SquareSystem(std::size_t size)
    : size_(size),
      stride_(whole_vectors(size)),
      A_(size * stride_, 0.0),
      L_(size * stride_, 0.0),
      inverse_(size, 1.0),
      order_(size, 0) {
  for (std::size_t i = 0; i < size; ++i) A_[i * stride_ + i] = 1.0;
  std::iota(order_.begin(), order_.end(), std::size_t{0});
}

void SquareSystem::factorise() noexcept TANDEM_RT {
  std::iota(order_.begin(), order_.end(), std::size_t{0});
  eliminate(size_, stride_, A_.data(), L_.data(), inverse_.data(), order_.data());
}

void SquareSystem::solve(std::span<const Two> b, std::span<Two> x) const noexcept TANDEM_RT {
  for (std::size_t i = 0; i < size_; ++i) {
    const double* factors = &L_[order_[i] * stride_];
    Two rest = b[order_[i]];
    for (std::size_t k = 0; k < i; ++k) subtract(factors[k], x[k], rest);
    x[i] = rest;
  }
  for (std::size_t i = size_; i-- > 0;) {
    const double* upper = &A_[order_[i] * stride_];
    Two rest = x[i];
    for (std::size_t k = i + 1; k < size_; ++k) subtract(upper[k], x[k], rest);
    x[i] = {rest[0] * inverse_[i], rest[1] * inverse_[i]};
  }
}

}  // namespace tandem
