// What numbers of points say: intervals of shares, pairs that differ, ranks.
// Layer: sweep.  Thread: any.
#pragma once

#include <cstdint>
#include <optional>
#include <span>

namespace tandem::sweep {

struct Interval {
  double low = 0.0, high = 1.0;
};

/// Wilson's score interval, 95 %, of a share of which `hits` in `all` were seen. 0 to 1 of none.
[[nodiscard]] Interval wilson(std::uint64_t hits, std::uint64_t all);

/// McNemar's exact test, two-sided: how likely pairs that differ are split at least so unevenly
/// when neither side is better. 1 without any.
/// @param first, second  pairs in which only that side passed
[[nodiscard]] double mcnemar(std::uint64_t first, std::uint64_t second);

/// Spearman's rank correlation, -1 to 1: how far one rises whenever the other does. Ties have the
/// mean of their ranks. Empty: fewer than 3, or one of them is constant.
/// @pre x.size() == y.size(); no NaN
[[nodiscard]] std::optional<double> rank_correlation(std::span<const double> x,
                                                     std::span<const double> y);

}  // namespace tandem::sweep
