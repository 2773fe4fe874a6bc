// From equations to parameters: weighted least squares with honest weights, base parameters, and
// full parameters of bodies that can exist.
// Layer: identification.  Thread: non-RT only.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "identification/base_parameters.hpp"
#include "identification/samples.hpp"

namespace tandem::identification {

/// What is known before the log, as a normal distribution about the description: which makes every
/// combination of parameters have a scale, and units comparable.
struct Prior {
  Eigen::VectorXd mean;    ///< (columns): the description
  Eigen::MatrixXd metric;  ///< (columns x columns), positive definite, block diagonal: the inverse
                           ///< of "one unit"
};
[[nodiscard]] Prior make_prior(const IdentifiedRobot& robot);

/// Factor that makes Prior::metric an inverse covariance: half a unit is the standard deviation.
/// In 95 % of all cases a link's described mass is then off by no more than itself.
inline constexpr double kBelieved = 4.0;

/// What the data say, and they alone: `mean` is the least-squares solution that is nearest to the
/// description where the data leave a choice.
struct DataEstimate {
  Eigen::VectorXd mean;        ///< (columns)
  Eigen::MatrixXd covariance;  ///< (columns x columns); huge where the data say nothing
  /// The same when the description is believed as by kBelieved: most parameters of a link show in
  /// combinations with those of its neighbours only, and vary by what those may be wrong.
  Eigen::MatrixXd link_covariance;
  Eigen::MatrixXd information;  ///< inverse of the covariance by the data: singular
  Eigen::VectorXd target;       ///< information times the data's solution
  double quantile = 0.0;   ///< of 95 %, in standard deviations: of Student's t distribution, for
                           ///< the noise is estimated, too
  double condition = 0.0;  ///< of the base parameters' columns, weighted and scaled
};

/// Rows of `equations` of whose instants `used` is true. Each channel is weighted by the inverse of
/// its residual's long-run variance (Newey, West 1987): what the mean of correlated noise varies
/// by, so that the covariance accounts for filtered noise and for errors of the model. The
/// covariance is a sandwich (White 1980): it holds with errors that channels have in common. What
/// equations.sensor_noise adds to the sums is taken away (errors in variables).
[[nodiscard]] DataEstimate estimate_from_data(const Equations& equations,
                                              const std::vector<bool>& used, const Prior& prior,
                                              const BaseParameters& base);

/// Full parameters of bodies that can exist. Where the data decide they decide; elsewhere few links
/// change much rather than many a little: Student's t distribution of every link's distance to its
/// description in the natural metric, by iterated weights, widest first. Log-Cholesky coordinates
/// and Levenberg-Marquardt steps keep every body possible.
[[nodiscard]] Eigen::VectorXd possible_parameters(const DataEstimate& data, const Prior& prior,
                                                  Eigen::Index links);

/// Lags that the long-run variance of `n` residuals takes: their cubic root.
[[nodiscard]] int lags_of(double n);

/// In how many standard deviations 95 % lie when the long-run variance of `n` residuals is
/// estimated with these lags: Student's t with as many degrees of freedom as Bartlett's window
/// leaves, 3 n / 4 lags.
[[nodiscard]] double quantile95(double n, int lags);

/// Covariance of the sum of correlated rows, one column a channel; a row of zeros is one that is
/// missing. Positive semidefinite, by Bartlett's window.
[[nodiscard]] Eigen::MatrixXd long_run_covariance(const Eigen::MatrixXd& residuals, int lags);

/// Variance of the sum of a correlated sequence over its length: autocovariances up to `lags`,
/// weighted by Bartlett's window.
[[nodiscard]] double long_run_variance(const Eigen::VectorXd& residual,
                                       const std::vector<std::size_t>& instant, int lags);

}  // namespace tandem::identification
