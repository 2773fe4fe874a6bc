// Base parameters: the fewest combinations of parameters that the equations depend on.
// Layer: identification.  Thread: any.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "identification/regressor.hpp"

namespace tandem::identification {

/// A X p = X[:, independent] (combination p) for every regressor matrix X of the same robot.
struct BaseParameters {
  std::vector<Eigen::Index> independent;  ///< columns, ascending
  /// (independent x columns): the identity in the independent columns; zero where a parameter
  /// has no effect.
  Eigen::MatrixXd combination;

  [[nodiscard]] Eigen::Index count() const { return static_cast<Eigen::Index>(independent.size()); }
};

/// By QR with column pivoting of any regressor matrix that excites everything (Gautier 1991).
/// Columns are scaled to unit length first; what is left below `tolerance` is rounding.
[[nodiscard]] BaseParameters base_parameters_of(const Eigen::MatrixXd& X, double tolerance = 1e-9);

/// A regressor matrix of `instants` random states (seeded), all channels one below the other: what
/// the structure allows, whatever a log holds.
[[nodiscard]] Eigen::MatrixXd random_regressor(Regressor& regressor, const model::Tree& tree,
                                               int instants, std::uint64_t seed);

/// One random state: positions within a radian (0.3 m) of 0, rates and accelerations of a few per
/// second, a base in any orientation.
[[nodiscard]] Instant random_instant(const Regressor& regressor, const model::Tree& tree,
                                     std::size_t sensors, std::uint64_t& seed);

/// Condition of a regressor's columns, each scaled to unit length, from their Gram matrix X^T X.
/// Infinite when they are dependent to rounding.
[[nodiscard]] double condition_number(const Eigen::MatrixXd& gram);

}  // namespace tandem::identification
