// What a sweep amounts to: shares, the worst points, two variants compared, what margins hang on.
// Layer: sweep.  Thread: any.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "apps/text/figures.hpp"
#include "sweep/results.hpp"
#include "sweep/statistics.hpp"
#include "sweep/study.hpp"

namespace tandem::sweep {

/// How many points passed.
struct PassRate {
  std::string variant;  ///< empty: of all
  std::uint64_t passed = 0, all = 0;
  [[nodiscard]] Interval interval() const { return wilson(passed, all); }
};
void figures(apps::Figures& f, const PassRate& rate);

/// One of the worst points.
struct WorstPoint {
  std::string point, variant, why, command;
  bool passed = false;
};
void figures(apps::Figures& f, const WorstPoint& point);

/// Another variant against the first one, on the same samples and seeds.
struct Comparison {
  std::string first, other;
  std::uint64_t both = 0, neither = 0, only_first = 0, only_other = 0;
  [[nodiscard]] double p() const { return mcnemar(only_first, only_other); }
};
void figures(apps::Figures& f, const Comparison& comparison);

/// How far a margin rises with a key.
struct Sensitivity {
  std::string key, expectation;
  double rank_correlation = 0.0;
  std::uint64_t points = 0;
};
void figures(apps::Figures& f, const Sensitivity& one);

struct SweepSummary {
  std::string folder;
  std::uint64_t points = 0, done = 0;
  PassRate rate;
  std::vector<PassRate> variants;
  std::vector<std::pair<std::string, std::uint64_t>> ends;  ///< how many ended so, most first
  std::vector<WorstPoint> worst;                            ///< ten at most
  std::vector<Comparison> comparisons;
  std::vector<Sensitivity> ranking;  ///< strongest first
};
void figures(apps::Figures& f, const SweepSummary& summary);

/// Worst are points that failed without a margin (crashed, refused, fell) first, then by the least
/// margin, each expectation's as a multiple of the median of its absolute values: so units do not
/// matter.
[[nodiscard]] SweepSummary summary_of(const Study& study, const Points& points,
                                      const std::vector<std::optional<PointResult>>& results);

/// A varied value as a number; of texts and booleans their place in the list.
[[nodiscard]] double number_of(const Vary& vary, const std::string& value);

}  // namespace tandem::sweep
