#include "sweep/summary.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <map>
#include <set>

#include "sweep/table.hpp"

namespace tandem::sweep {
namespace {

constexpr std::size_t kWorst = 10;
using Results = std::vector<std::optional<PointResult>>;

/// Median of the absolute margins of each expectation.
std::map<std::string, double> scales_of(const Results& results) {
  std::map<std::string, std::vector<double>> sizes;
  for (const auto& result : results) {
    if (!result) continue;
    for (const auto& one : result->expectations) {
      if (one.margin && *one.margin != 0.0) sizes[one.name].push_back(std::abs(*one.margin));
    }
  }
  std::map<std::string, double> scales;
  for (auto& [name, all] : sizes) {
    const auto middle = all.begin() + static_cast<std::ptrdiff_t>(all.size() / 2);
    std::ranges::nth_element(all, middle);
    scales[name] = *middle;
  }
  return scales;
}

double badness(const PointResult& result, const std::map<std::string, double>& scales) {
  constexpr double kNone = std::numeric_limits<double>::infinity();
  if (!result.passed && result.expectations.empty()) return -kNone;
  double least = kNone;
  for (const auto& one : result.expectations) {
    if (!one.passed && !one.margin) return -kNone;
    const auto scale = scales.find(one.name);
    if (one.margin && scale != scales.end()) least = std::min(least, *one.margin / scale->second);
  }
  return least;
}

std::string variant_name(const Study& study, const Point& point) {
  return study.variants.empty() ? "" : study.variants[point.variant].name;
}

std::vector<WorstPoint> worst_of(const Study& study, const Points& points, const Results& results) {
  const auto scales = scales_of(results);
  std::vector<std::tuple<bool, double, std::uint64_t>> order;
  for (std::size_t i = 0; i < results.size(); ++i) {
    if (results[i]) order.emplace_back(results[i]->passed, badness(*results[i], scales), i);
  }
  const std::size_t count = std::min(kWorst, order.size());
  std::ranges::partial_sort(order, order.begin() + static_cast<std::ptrdiff_t>(count));
  std::vector<WorstPoint> worst;
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint64_t index = std::get<2>(order[i]);
    const Point point = points.at(index);
    const PointResult& result = *results[static_cast<std::size_t>(index)];
    worst.push_back({.point = point.name,
                     .variant = variant_name(study, point),
                     .why = result.why(),
                     .command = point.command(study.experiment),
                     .passed = result.passed});
  }
  return worst;
}

std::vector<Comparison> comparisons_of(const Study& study, const Results& results) {
  std::vector<Comparison> all;
  const std::size_t count = study.variants.size();
  for (std::size_t other = 1; other < count; ++other) {
    Comparison one;
    one.first = study.variants[0].name;
    one.other = study.variants[other].name;
    for (std::size_t i = 0; i + count <= results.size(); i += count) {
      const auto &a = results[i], &b = results[i + other];
      if (!a || !b) continue;
      ++(a->passed ? (b->passed ? one.both : one.only_first)
                   : (b->passed ? one.only_other : one.neither));
    }
    all.push_back(std::move(one));
  }
  return all;
}

std::vector<Sensitivity> ranking_of(const Study& study, const Points& points,
                                    const Results& results) {
  std::vector<Sensitivity> all;
  for (const NamedMargin& margin : margins_of(results)) {
    std::vector<double> margins;
    std::vector<std::vector<double>> values(study.vary.size());
    for (std::size_t i = 0; i < results.size(); ++i) {
      const auto* one = results[i] ? expectation_in(*results[i], margin.name) : nullptr;
      if (one == nullptr || !one->margin) continue;
      margins.push_back(*one->margin);
      const Point point = points.at(i);
      for (std::size_t k = 0; k < values.size(); ++k)
        values[k].push_back(number_of(study.vary[k], point.values[k]));
    }
    for (std::size_t k = 0; k < values.size(); ++k) {
      const auto rho = rank_correlation(values[k], margins);
      if (rho) all.push_back({study.vary[k].key, margin.name, *rho, margins.size()});
    }
  }
  std::ranges::stable_sort(all, std::greater<>(),
                           [](const Sensitivity& one) { return std::abs(one.rank_correlation); });
  return all;
}

void rate_figures(apps::Figures& f, const PassRate& rate) {
  const Interval interval = rate.interval();
  f("passed", "points", rate.passed);
  f("of", "points that have a result", rate.all);
  f("low", "Wilson's interval of the share, 95 %", interval.low);
  f("high", interval.high);
}

}  // namespace

double number_of(const Vary& vary, const std::string& value) {
  double number = 0.0;
  const char* const end = value.data() + value.size();
  const auto read = std::from_chars(value.data(), end, number);
  if (read.ec == std::errc() && read.ptr == end) return number;
  return static_cast<double>(std::ranges::find(vary.values, value) - vary.values.begin());
}

SweepSummary summary_of(const Study& study, const Points& points, const Results& results) {
  SweepSummary summary;
  summary.points = points.size();
  std::map<std::string, std::uint64_t> ends;
  for (const Variant& variant : study.variants)
    summary.variants.push_back({.variant = variant.name, .passed = 0, .all = 0});
  for (std::size_t i = 0; i < results.size(); ++i) {
    if (!results[i]) continue;
    ++summary.done;
    ++ends[results[i]->ended];
    const auto count = [&](PassRate& rate) {
      ++rate.all;
      rate.passed += results[i]->passed ? 1 : 0;
    };
    count(summary.rate);
    if (!study.variants.empty()) count(summary.variants[i % study.variants.size()]);
  }
  summary.ends.assign(ends.begin(), ends.end());
  std::ranges::stable_sort(summary.ends, std::greater<>(),
                           &std::pair<std::string, std::uint64_t>::second);
  summary.worst = worst_of(study, points, results);
  summary.comparisons = comparisons_of(study, results);
  summary.ranking = ranking_of(study, points, results);
  return summary;
}

void figures(apps::Figures& f, const PassRate& rate) {
  f("variant", "empty: all", rate.variant);
  rate_figures(f, rate);
}

void figures(apps::Figures& f, const WorstPoint& point) {
  f("point", "its name in results.csv", point.point);
  f("variant", "empty: there are none", point.variant);
  f("passed", point.passed);
  f("why", "why it failed", point.why);
  f("command", "that repeats it", point.command);
}

void figures(apps::Figures& f, const Comparison& one) {
  f("first", "the variant that the other is compared with", one.first);
  f("other", one.other);
  f("both", "pairs in which both passed", one.both);
  f("neither", one.neither);
  f("only_first", one.only_first);
  f("only_other", one.only_other);
  f("p", "McNemar's exact test, two-sided: so likely is such a split without a difference",
    one.p());
}

void figures(apps::Figures& f, const Sensitivity& one) {
  f("key", one.key);
  f("expectation", "whose margin", one.expectation);
  f("rank_correlation", "Spearman's, -1 to 1: how far the margin rises with the key",
    one.rank_correlation);
  f("points", "with a margin", one.points);
}

void figures(apps::Figures& f, const SweepSummary& s) {
  f("folder", "of the results", s.folder);
  f("points", "of the study", s.points);
  f("done", "points that have a result", s.done);
  f("rate", "of all points", s.rate);
  f("variants", "the same of each variant", s.variants);
  f("worst", "ten at most", s.worst);
  f("comparisons", "each other variant with the first one", s.comparisons);
  f("ranking", "of keys, strongest first", s.ranking);
}

}  // namespace tandem::sweep
