#include "identification/repeats.hpp"

#include <algorithm>
#include <cmath>

namespace tandem::identification {
namespace {

// Thresholds of difference(): up to kSame positions are the same, from kOther on they are others.
constexpr double kSame = 0.01, kOther = 0.3;

// Instants from which the median is known well enough, whatever the log's length.
constexpr std::size_t kInstants = 2000;

/// Positions every `stride` samples, each joint with mean 0 and variance 1: those that move.
std::vector<Signal> standardised(const std::vector<Signal>& position, std::size_t stride) {
  std::vector<Signal> out;
  for (const Signal& whole : position) {
    Signal one;
    double sum = 0.0, squares = 0.0, n = 0.0;
    for (std::size_t i = 0; i < whole.size(); i += stride) {
      one.push_back(whole[i]);
      if (!std::isfinite(whole[i])) continue;
      sum += whole[i];
      squares += whole[i] * whole[i];
      n += 1.0;
    }
    const double variance = n > 0.0 ? squares / n - (sum / n) * (sum / n) : 0.0;
    if (!(variance > 1e-6)) continue;
    for (double& value : one) value = (value - sum / n) / std::sqrt(variance);
    out.push_back(std::move(one));
  }
  return out;
}

/// Squared difference of positions `lag` apart, about 1 for unrelated ones. The median over time,
/// so that a rest before or after does not count.
double difference(const std::vector<Signal>& position, std::size_t lag) {
  std::vector<double> squares;
  const std::size_t n = position.front().size(), hop = 1 + (n - lag) / kInstants;
  for (std::size_t i = lag; i < n; i += hop) {
    double sum = 0.0;
    for (const Signal& one : position)
      sum += 0.5 * (one[i] - one[i - lag]) * (one[i] - one[i - lag]);
    if (std::isfinite(sum)) squares.push_back(sum / static_cast<double>(position.size()));
  }
  if (squares.empty()) return 1.0;
  const auto middle = squares.begin() + static_cast<std::ptrdiff_t>(squares.size() / 2);
  std::ranges::nth_element(squares, middle);
  return *middle;
}

/// Long-run sum of squares of a cyclic or a straight sequence, by Bartlett's window.
double long_run_sum(const Eigen::VectorXd& values, int lags, bool cyclic) {
  const Eigen::Index n = values.size();
  double sum = values.squaredNorm();
  for (Eigen::Index lag = 1; lag <= std::min<Eigen::Index>(lags, n - 1); ++lag) {
    double product = values.tail(n - lag).dot(values.head(n - lag));
    if (cyclic) product += values.tail(lag).dot(values.head(lag));
    sum += 2.0 * (1.0 - static_cast<double>(lag) / (lags + 1.0)) * product;
  }
  return sum;
}

}  // namespace

double motion_period_s(const std::vector<Signal>& position, double period_s, std::size_t stride) {
  const std::vector<Signal> motion = standardised(position, stride);
  if (motion.empty()) return 0.0;
  const std::size_t n = motion.front().size();
  std::size_t first = 1;
  while (first <= n / 2 && difference(motion, first) < kOther) ++first;
  for (; first <= n / 2 && difference(motion, first) > kSame; ++first) {
  }
  if (first > n / 2) return 0.0;
  while (first < n / 2 && difference(motion, first + 1) < difference(motion, first)) ++first;
  // Over k periods a step is 1 / k of one. Less than half a period around, so that it stays the
  // k-th.
  const std::size_t around = std::min<std::size_t>(2, (first - 1) / 2);
  auto period = static_cast<double>(first);
  for (std::size_t k = 2; k <= n / first; ++k) {
    const double periods = static_cast<double>(k) * period;
    if (periods > 0.5 * static_cast<double>(n)) break;
    const std::size_t lag = static_cast<std::size_t>(periods) - around;
    std::size_t best = lag;
    for (std::size_t one = lag; one <= lag + 2 * around && one < n; ++one)
      if (difference(motion, one) < difference(motion, best)) best = one;
    period = static_cast<double>(best) / static_cast<double>(k);
  }
  return period * period_s * static_cast<double>(stride);
}

double repeat_factor(const Eigen::VectorXd& residual, const std::vector<double>& time_s,
                     double period_s, double stride_s, int lags) {
  const auto phases = static_cast<Eigen::Index>(std::lround(period_s / stride_s));
  if (time_s.size() < 2 || phases < 2) return 1.0;
  const auto length =
      static_cast<Eigen::Index>(std::lround((time_s.back() - time_s.front()) / stride_s)) + 1;
  Eigen::VectorXd straight = Eigen::VectorXd::Zero(length);
  Eigen::VectorXd folded = Eigen::VectorXd::Zero(phases), count = folded;
  for (std::size_t i = 0; i < time_s.size(); ++i) {
    const double since = time_s[i] - time_s.front();
    const double phase = since / period_s - std::floor(since / period_s);
    const auto k =
        static_cast<Eigen::Index>(std::lround(phase * static_cast<double>(phases))) % phases;
    straight[static_cast<Eigen::Index>(std::lround(since / stride_s))] =
        residual[static_cast<Eigen::Index>(i)];
    folded[k] += residual[static_cast<Eigen::Index>(i)];
    count[k] += 1.0;
  }
  const double within = long_run_sum(straight, lags, false) / static_cast<double>(time_s.size());
  folded.array() /= count.array().max(1.0).sqrt();
  const double used = (count.array() > 0.0).cast<double>().sum();
  const double across = long_run_sum(folded, lags, true) / used;
  return within > 0.0 ? std::clamp(across / within, 1.0, std::max(1.0, count.maxCoeff())) : 1.0;
}

}  // namespace tandem::identification
