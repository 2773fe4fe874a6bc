// Finite Fourier series that begin and end at rest.
// Layer: identification.  Thread: any.
#pragma once

#include <Eigen/Core>
#include <cstdint>

namespace tandem::identification {

/// x(t) = x0 + sum_k a_k (cos k w t - 1) + b_k sin k w t, k from 1, w = 2 pi / period_s, for
/// several x at once. With sum k b_k = 0 and sum k^2 a_k = 0 it starts at x0 with no speed and no
/// acceleration, and ends every period so (after Swevers et al., 1997).
struct ExcitingSeries {
  double period_s = 10.0;
  Eigen::VectorXd start;  ///< (n)
  Eigen::MatrixXd a, b;   ///< (harmonics x n)

  struct State {
    Eigen::VectorXd x, v, acceleration;
  };
  [[nodiscard]] State at(double t_s) const;
  /// Makes the two sums zero by the smallest change.
  void rest_at_the_ends();
};

/// Random coefficients of unit size, at rest at the ends; the same seed, the same series.
[[nodiscard]] ExcitingSeries random_series(const Eigen::VectorXd& start, int harmonics,
                                           double period_s, std::uint64_t& seed);

/// The series of values that were taken at equal intervals over one period, from its start on.
/// @param values  (samples x n); samples > 2 harmonics
[[nodiscard]] ExcitingSeries series_through(const Eigen::MatrixXd& values, int harmonics,
                                            double period_s);

}  // namespace tandem::identification
