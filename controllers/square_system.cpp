// Right sides are columns of their own. Rows stay where they are, and their order beside them. Left
// of its pivot a row keeps what nobody reads, so that its update may begin at a whole vector.
#include "controllers/square_system.hpp"

#include <algorithm>
#include <cmath>

namespace tandem {
namespace {

constexpr std::size_t kLanes = 2;  // of any x86-64
constexpr std::size_t kRights = 2;

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

}  // namespace

SquareSystem::SquareSystem(std::size_t size)
    : size_(size),
      stride_(whole_vectors(size + kRights)),
      rows_(size * stride_, 0.0),
      order_(size, 0) {}

void SquareSystem::set_right(std::size_t i, const Two& b) noexcept TANDEM_RT {
  std::ranges::copy(b, &rows_[i * stride_ + size_]);
}

/// Makes A upper triangular, in the order of the pivots. Each pivot is replaced by its inverse.
void SquareSystem::eliminate() noexcept TANDEM_RT {
  double* const rows = rows_.data();
  std::size_t* const order = order_.data();
  for (std::size_t i = 0; i < size_; ++i) order[i] = i * stride_;
  for (std::size_t k = 0; k < size_; ++k) {
    std::size_t best = k;
    double most = 0.0;
    for (std::size_t i = k; i < size_; ++i) {
      const double magnitude = std::abs(rows[order[i] + k]);
      best = magnitude > most ? i : best;
      most = std::max(most, magnitude);
    }
    std::swap(order[k], order[best]);
    double* const pivot_row = rows + order[k];
    const double inverse = 1.0 / pivot_row[k];
    const std::size_t first = k / kLanes * kLanes;
    for (std::size_t i = k + 1; i < size_; ++i) {
      double* const row = rows + order[i];
      if (row[k] == 0.0) continue;  // of another limb
      subtract(row[k] * inverse, pivot_row + first, row + first, stride_ - first);
    }
    pivot_row[k] = inverse;
  }
}

void SquareSystem::solve(std::span<Two> x) noexcept TANDEM_RT {
  eliminate();
  for (std::size_t i = size_; i-- > 0;) {
    const double* row = &rows_[order_[i]];
    Two rest{row[size_], row[size_ + 1]};
    for (std::size_t k = i + 1; k < size_; ++k) {
      rest[0] -= row[k] * x[k][0];
      rest[1] -= row[k] * x[k][1];
    }
    x[i] = {rest[0] * row[i], rest[1] * row[i]};
  }
}

}  // namespace tandem
