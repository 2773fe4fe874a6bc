// As many linear equations as unknowns, solved in the cycle.
// Layer: controllers.  Thread: construction non-RT; the rest any, RT-safe.
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "base/realtime.hpp"

namespace tandem {

/// A x = b for two b at a time, by Gauss' elimination with partial pivoting. Where a limb's
/// equations have nothing to do with another limb's unknowns, nothing is computed.
class SquareSystem {
 public:
  using Two = std::array<double, 2>;  ///< of two right sides, or of their solutions

  /// @param size  of A; 0 is none
  explicit SquareSystem(std::size_t size = 0);

  [[nodiscard]] std::size_t size() const noexcept { return size_; }
  /// Row `i` of A.
  [[nodiscard]] std::span<double> row(std::size_t i) noexcept {
    return {&rows_[i * stride_], size_};
  }
  void set_right(std::size_t i, const Two& b) noexcept TANDEM_RT;
  /// Rows and right sides have to be written anew for the next one. Solutions of a singular A are
  /// not finite.
  void solve(std::span<Two> x) noexcept TANDEM_RT;

 private:
  void eliminate() noexcept TANDEM_RT;

  std::size_t size_;
  std::size_t stride_;  // of rows: A's, both right sides, whole vectors
  std::vector<double> rows_;
  std::vector<std::size_t> order_;  // where rows begin, in the order of their pivots
};

}  // namespace tandem
