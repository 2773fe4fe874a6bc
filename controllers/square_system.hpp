// As many linear equations as unknowns, solved in the cycle.
// Layer: controllers.  Thread: construction non-RT; the rest any, RT-safe.
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "base/realtime.hpp"

namespace tandem {

/// A x = b for two b at a time: factorised once by Gauss' elimination with partial pivoting. Where
/// a limb's equations have nothing to do with another limb's unknowns, nothing is computed.
class SquareSystem {
 public:
  /// A is the identity. @param size  of A; 0 is none
  explicit SquareSystem(std::size_t size = 0);

  [[nodiscard]] std::size_t size() const noexcept { return size_; }
  /// Row `i` of A, to be written before factorise(), which overwrites all of A.
  [[nodiscard]] std::span<double> row(std::size_t i) noexcept { return {&A_[i * stride_], size_}; }
  void factorise() noexcept TANDEM_RT;

  using Two = std::array<double, 2>;  ///< of two right sides, or of their solutions
  /// Solutions of a singular A are not finite. @pre factorise() since a row was written
  void solve(std::span<const Two> b, std::span<Two> x) const noexcept TANDEM_RT;

 private:
  std::size_t size_;
  std::size_t stride_;  // of rows: whole vectors
  std::vector<double> A_;
  std::vector<double> L_;           // what a row took of each pivot's row
  std::vector<double> inverse_;     // of the pivots
  std::vector<std::size_t> order_;  // rows of A in the order of their pivots
};

}  // namespace tandem
