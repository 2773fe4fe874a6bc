#include "identification/low_pass.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace tandem::identification {
namespace {

constexpr double kKaiser = 7.857;    // beta for 80 dB
constexpr double kHalfWindow = 5.0;  // over the cut-off: the transition is a third of it

double kaiser(double x) {
  return std::cyl_bessel_i(0.0, kKaiser * std::sqrt(std::max(0.0, 1.0 - x * x)));
}

}  // namespace

LowPass::LowPass(double period_s, double cutoff_Hz)
    : stride_(std::max<std::size_t>(
          1, static_cast<std::size_t>(std::lround(0.5 / (cutoff_Hz * period_s))))) {
  const long half = std::max(1L, std::lround(kHalfWindow / (cutoff_Hz * period_s)));
  const auto size = static_cast<std::size_t>(2 * half + 3);  // one more at each end: differences
  std::vector<double>& w = weights_[0];
  w.assign(size, 0.0);
  double total = 0.0;
  for (long k = -half; k <= half; ++k) {
    const double x = 2.0 * cutoff_Hz * period_s * static_cast<double>(k);
    const double sinc = k == 0 ? 1.0 : std::sin(std::numbers::pi * x) / (std::numbers::pi * x);
    const double value = sinc * kaiser(static_cast<double>(k) / static_cast<double>(half));
    w[static_cast<std::size_t>(k + half + 1)] = value;
    total += value;
  }
  for (double& one : w) one /= total;
  const auto at = [&w, size](std::size_t i, long shift) {
    const long k = static_cast<long>(i) + shift;
    return k < 0 || k >= static_cast<long>(size) ? 0.0 : w[static_cast<std::size_t>(k)];
  };
  weights_[1].resize(size);
  weights_[2].resize(size);
  for (std::size_t i = 0; i < size; ++i) {
    weights_[1][i] = (at(i, -1) - at(i, 1)) / (2.0 * period_s);
    weights_[2][i] = (at(i, -1) - 2.0 * w[i] + at(i, 1)) / (period_s * period_s);
  }
}

double LowPass::noise(int order) const {
  double sum = 0.0;
  for (const double one : weights_[order]) sum += one * one;
  return sum;
}

double LowPass::sum(int order, std::span<const double> signal, std::size_t at) const {
  const std::vector<double>& w = weights_[order];
  const double* first = signal.data() + (at - reach());
  double result = 0.0;
  for (std::size_t k = 0; k < w.size(); ++k) result += w[k] * first[k];
  return result;
}

}  // namespace tandem::identification
