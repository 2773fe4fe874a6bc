// The least value of a function of a few numbers, of which nothing else is known: CMA-ES.
// Layer: apps/search.  Thread: main.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace tandem::apps {

/// Covariance matrix adaptation, generation by generation: ask(), evaluate, tell(). The algorithm
/// and its constants are those of Hansen, "The CMA Evolution Strategy: A Tutorial"
/// (arXiv:1604.00772v2, figure 6 and table 1), with negative weights. Points lie in the cube from 0
/// to 1: what would be outside is reflected at its sides, which makes the function a periodic one
/// without sides. The same seed and values give the same points.
class CmaEs {
 public:
  /// @param mean  (n) about which the first generation lies. @param sigma  and how far
  /// @param population  points a generation, at least 4; 0: 4 + 3 ln n
  CmaEs(Eigen::VectorXd mean, double sigma, std::uint64_t seed, std::size_t population = 0);

  /// The next generation.
  [[nodiscard]] std::vector<Eigen::VectorXd> ask();
  /// What the function is there, in the same order; NaN: it has no value, and counts as larger than
  /// any. The search does not move towards it.
  void tell(std::span<const double> values);

  /// Whether further generations are of no use: all points lie within `resolution`, or the last
  /// generations found equal values only.
  [[nodiscard]] bool has_converged(double resolution) const;
  [[nodiscard]] std::size_t population() const { return population_; }

 private:
  [[nodiscard]] double normal();
  void decompose();

  Eigen::Index n_;
  std::size_t population_;
  std::uint64_t random_;  // of split_mix()
  Eigen::VectorXd weights_;
  double mu_eff_ = 0.0, c_sigma_ = 0.0, d_sigma_ = 0.0, c_c_ = 0.0, c_1_ = 0.0, c_mu_ = 0.0;
  double chi_ = 0.0;  // mean length of n normal numbers

  Eigen::VectorXd mean_, p_sigma_, p_c_;
  double sigma_;
  Eigen::MatrixXd covariance_, axes_;   // C = B D² Bᵀ
  Eigen::VectorXd lengths_;             // D
  std::vector<Eigen::VectorXd> steps_;  // of the generation: (x - mean) / sigma
  std::size_t generations_ = 0, flat_ = 0;
};

}  // namespace tandem::apps
