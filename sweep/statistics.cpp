#include "sweep/statistics.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

namespace tandem::sweep {
namespace {

std::vector<double> ranks(std::span<const double> values) {
  std::vector<std::size_t> order(values.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::stable_sort(order, {}, [&](std::size_t i) { return values[i]; });
  std::vector<double> rank(values.size());
  for (std::size_t from = 0; from < order.size();) {
    std::size_t to = from;
    while (to < order.size() && values[order[to]] == values[order[from]]) ++to;
    for (std::size_t i = from; i < to; ++i)
      rank[order[i]] = 0.5 * static_cast<double>(from + to - 1);
    from = to;
  }
  return rank;
}

}  // namespace

Interval wilson(std::uint64_t hits, std::uint64_t all) {
  if (all == 0) return {};
  constexpr double z = 1.959963984540054;
  const auto n = static_cast<double>(all);
  const double share = static_cast<double>(hits) / n;
  const double middle = share + z * z / (2.0 * n);
  const double reach = z * std::sqrt(share * (1.0 - share) / n + z * z / (4.0 * n * n));
  const double scale = 1.0 + z * z / n;
  return {hits == 0 ? 0.0 : (middle - reach) / scale, hits == all ? 1.0 : (middle + reach) / scale};
}

double mcnemar(std::uint64_t first, std::uint64_t second) {
  const std::uint64_t all = first + second;
  const auto n = static_cast<double>(all);
  double sum = 0.0;
  for (std::uint64_t k = 0; k <= std::min(first, second) && all > 0; ++k) {
    const auto m = static_cast<double>(k);
    sum += std::exp(std::lgamma(n + 1.0) - std::lgamma(m + 1.0) - std::lgamma(n - m + 1.0) -
                    n * std::log(2.0));
  }
  return all == 0 ? 1.0 : std::min(1.0, 2.0 * sum);
}

std::optional<double> rank_correlation(std::span<const double> x, std::span<const double> y) {
  if (x.size() < 3) return std::nullopt;
  const std::vector<double> a = ranks(x), b = ranks(y);
  const double mean = 0.5 * static_cast<double>(x.size() - 1);
  double ab = 0.0, aa = 0.0, bb = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    ab += (a[i] - mean) * (b[i] - mean);
    aa += (a[i] - mean) * (a[i] - mean);
    bb += (b[i] - mean) * (b[i] - mean);
  }
  if (aa == 0.0 || bb == 0.0) return std::nullopt;
  return ab / std::sqrt(aa * bb);
}

}  // namespace tandem::sweep
