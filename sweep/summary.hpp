// What a sweep amounts to: shares, the worst points, two variants compared, what margins hang on.
// Layer: sweep.  Thread: any.
#pragma once

#include <cmath>
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

/// How many points passed, of those that ran.
struct PassRate {
  std::string variant;  ///< empty: of all
  std::uint64_t passed = 0, all = 0;
  std::uint64_t refused = 0;  ///< beside them: a value that the readers do not take
  [[nodiscard]] Interval interval() const { return wilson(passed, all); }
};
void figures(apps::Figures& f, const PassRate& rate);

/// One of the worst points, for all of its values.
struct WorstPoint {
  std::string point, variant, why, command;
  bool passed = false;
  std::uint64_t more = 0;  ///< others of its values that failed, too

  /// " and 3 more seeds"; empty: none.
  [[nodiscard]] std::string more_text(const Study& study) const;
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
  std::uint64_t points = 0, without_margin = 0;
};
void figures(apps::Figures& f, const Sensitivity& one);

struct SweepSummary {
  std::string folder, directory;  ///< of the results; in which the commands are typed
  std::uint64_t points = 0, done = 0;
  bool seeds_alike = false;  ///< they change nothing: the points of one of them count
  std::string refused_why;   ///< of the first that was
  PassRate rate;
  std::vector<PassRate> variants;
  std::vector<std::pair<std::string, std::uint64_t>> ends;  ///< how many ended so, most first
  std::vector<WorstPoint> worst;                            ///< ten at most
  std::vector<Comparison> comparisons;
  std::vector<Sensitivity> ranking;  ///< strongest first
};
void figures(apps::Figures& f, const SweepSummary& summary);

/// Worst are points that failed without a margin (crashed, fell) first, but no more than leaves
/// half of the rows for others that failed, then by the least margin: each expectation's as a
/// multiple of the median of its absolute values, so units do not matter. Those of the same values
/// are one row.
[[nodiscard]] SweepSummary summary_of(const Study& study, const Points& points,
                                      const std::vector<std::optional<PointResult>>& results);

/// What one point's expectation came to.
struct MarginOfPoint {
  std::uint64_t index = 0;
  double margin = 0.0;  ///< minus infinity: it failed, or its run did, without one
  bool failed = false;  ///< the expectation
  [[nodiscard]] bool has_margin() const { return std::isfinite(margin); }
};
/// Those of each point that ran; where it passed without a margin there is none.
[[nodiscard]] std::vector<MarginOfPoint> margins_in(
    const std::vector<std::optional<PointResult>>& results, const std::string& expectation);

/// The numbers of the points that [keep] wants logs of: the sample of those that passed in their
/// order, then those that failed, worst first.
[[nodiscard]] std::vector<std::uint64_t> kept_points(
    const Keep& keep, const std::vector<std::optional<PointResult>>& results);

/// Whether a point never ran, as the readers refuse a value.
[[nodiscard]] bool was_refused(const PointResult& result);

/// A varied value as a number; of texts and booleans their place in the list.
[[nodiscard]] double number_of(const Vary& vary, const std::string& value);

}  // namespace tandem::sweep
