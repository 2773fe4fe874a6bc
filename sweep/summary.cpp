#include "sweep/summary.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <tuple>

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

constexpr double kNoMargin = -std::numeric_limits<double>::infinity();

/// How bad a point is, and by what.
struct Badness {
  bool passed = true, by_margin = true;
  double least = std::numeric_limits<double>::infinity();  // scaled margin
  std::string why;
  auto operator<=>(const Badness& other) const {
    return std::tuple(passed, by_margin, least) <=>
           std::tuple(other.passed, other.by_margin, other.least);
  }
  bool operator==(const Badness&) const = default;
};

std::string words_of(const runtime::ExpectationResult& one) {
  if (!one.reason.empty()) return one.name + ": " + one.reason;
  if (!one.margin) return one.name;
  return fmt::format("{}: margin {:.3g}{}{}", one.name, *one.margin, one.unit.empty() ? "" : " ",
                     one.unit);
}

Badness badness(const PointResult& result, const std::map<std::string, double>& scales) {
  Badness bad;
  bad.passed = result.passed;
  bool any_failed = false;
  for (const auto& one : result.expectations) {
    any_failed = any_failed || !one.passed;
    const auto scale = scales.find(one.name);
    if (!one.passed && !one.margin && bad.by_margin) {
      bad.by_margin = false;
      bad.why = words_of(one);
    }
    if (!one.margin) continue;
    const double margin = scale == scales.end() ? 0.0 : *one.margin / scale->second;
    if (margin >= bad.least) continue;
    bad.least = margin;
    if (bad.by_margin) bad.why = words_of(one);
  }
  if (result.passed || any_failed) return bad;
  bad.by_margin = false;
  bad.why = result.why();
  return bad;
}

std::string variant_name(const Study& study, const Point& point) {
  return study.variants.empty() ? "" : study.variants[point.variant].name;
}

/// The worst of a sample, of which seeds and variants differ.
struct WorstOfSample {
  Badness bad;
  std::uint64_t index = 0, failed = 0;
};

std::vector<WorstOfSample> worst_of_samples(const Study& study, const Results& results) {
  const auto scales = scales_of(results);
  const std::size_t size = study.seeds.size() * std::max<std::size_t>(1, study.variants.size());
  std::vector<WorstOfSample> all;
  for (std::size_t from = 0; from < results.size(); from += size) {
    std::optional<WorstOfSample> worst;
    std::uint64_t failed = 0;
    for (std::size_t i = from; i < std::min(from + size, results.size()); ++i) {
      if (!results[i] || was_refused(*results[i])) continue;
      failed += results[i]->passed ? 0 : 1;
      Badness bad = badness(*results[i], scales);
      if (!worst || bad < worst->bad) worst = {.bad = std::move(bad), .index = i};
    }
    if (!worst) continue;
    worst->failed = failed;
    all.push_back(std::move(*worst));
  }
  std::ranges::stable_sort(all, std::less<>(), &WorstOfSample::bad);
  return all;
}

std::vector<WorstPoint> worst_of(const Study& study, const Points& points, const Results& results) {
  const std::vector<WorstOfSample> order = worst_of_samples(study, results);
  const auto by_margin = static_cast<std::size_t>(std::ranges::count_if(
      order, [](const auto& one) { return !one.bad.passed && one.bad.by_margin; }));
  const std::size_t most_without = kWorst - std::min(kWorst / 2, by_margin);
  std::size_t without = 0;
  std::set<std::vector<std::string>> known;
  std::vector<WorstPoint> worst;
  for (const WorstOfSample& one : order) {
    if (worst.size() == kWorst) break;
    if (!one.bad.by_margin && without == most_without) continue;
    const Point point = points.at(one.index);
    if (!known.insert(point.values).second) continue;
    without += one.bad.by_margin ? 0 : 1;
    worst.push_back({.point = point.name,
                     .variant = variant_name(study, point),
                     .why = one.bad.why,
                     .command = point.command(study.experiment),
                     .passed = one.bad.passed,
                     .more = one.failed > 0 ? one.failed - 1 : 0});
  }
  return worst;
}

/// Whether the seeds of each sample and variant have the same results to the last bit.
bool seeds_are_alike(const Study& study, const Results& results) {
  const std::size_t variants = std::max<std::size_t>(1, study.variants.size());
  const std::size_t size = variants * study.seeds.size();
  bool any = false;
  for (std::size_t i = 0; i < results.size(); ++i) {
    const auto &one = results[i], &first = results[i - i % size + i % variants];
    if (&one == &first || !one || !first || was_refused(*one)) continue;
    if (one->passed != first->passed || one->ended != first->ended ||
        one->reason != first->reason || one->expectations != first->expectations)
      return false;
    any = true;
  }
  return any;
}

/// The results of the first seed alone.
Results of_one_seed(const Study& study, Results results) {
  const std::size_t variants = std::max<std::size_t>(1, study.variants.size());
  for (std::size_t i = 0; i < results.size(); ++i)
    if (i / variants % study.seeds.size() != 0) results[i].reset();
  return results;
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
      if (!a || !b || was_refused(*a) || was_refused(*b)) continue;
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
    std::uint64_t without = 0;
    for (const MarginOfPoint& one : margins_in(results, margin.name)) {
      margins.push_back(one.margin);
      without += one.has_margin() ? 0 : 1;
      const Point point = points.at(one.index);
      for (std::size_t k = 0; k < values.size(); ++k)
        values[k].push_back(number_of(study.vary[k], point.values[k]));
    }
    for (std::size_t k = 0; k < values.size(); ++k) {
      const auto rho = rank_correlation(values[k], margins);
      if (rho) all.push_back({study.vary[k].key, margin.name, *rho, margins.size(), without});
    }
  }
  std::ranges::stable_sort(all, std::greater<>(),
                           [](const Sensitivity& one) { return std::abs(one.rank_correlation); });
  return all;
}

void rate_figures(apps::Figures& f, const PassRate& rate) {
  const Interval interval = rate.interval();
  f("passed", "points", rate.passed);
  f("of", "points that ran", rate.all);
  f("refused", "points beside them that did not run, as a value was not taken", rate.refused);
  f("low", "Wilson's interval of the share, 95 %", interval.low);
  f("high", interval.high);
}

}  // namespace

bool was_refused(const PointResult& result) { return result.ended == "refused"; }

std::vector<MarginOfPoint> margins_in(const Results& results, const std::string& expectation) {
  std::vector<MarginOfPoint> all;
  for (std::size_t i = 0; i < results.size(); ++i) {
    if (!results[i] || was_refused(*results[i])) continue;
    const auto* one = expectation_in(*results[i], expectation);
    const bool failed = one == nullptr ? !results[i]->passed : !one->passed;
    if (one != nullptr && one->margin) {
      all.push_back({.index = i, .margin = *one->margin, .failed = failed});
    } else if (failed) {
      all.push_back({.index = i, .margin = kNoMargin, .failed = true});
    }
  }
  return all;
}

std::vector<std::uint64_t> kept_points(const Keep& keep, const Results& results) {
  const auto scales = scales_of(results);
  std::vector<std::uint64_t> kept;
  std::vector<std::pair<Badness, std::uint64_t>> failed;
  for (std::size_t i = 0; i < results.size(); ++i) {
    if (!results[i] || was_refused(*results[i])) continue;
    if (!results[i]->passed) {
      failed.emplace_back(badness(*results[i], scales), i);
    } else if (kept.size() < keep.sample) {
      kept.push_back(i);
    }
  }
  std::ranges::stable_sort(failed, std::less<>(), &std::pair<Badness, std::uint64_t>::first);
  for (const auto& [bad, index] : failed) kept.push_back(index);
  return kept;
}

std::string WorstPoint::more_text(const Study& study) const {
  if (more == 0) return {};
  const std::string what = study.variants.empty()   ? "seed"
                           : study.seeds.size() > 1 ? "seed or variant"
                                                    : "variant";
  return fmt::format(" and {} more {}{}", more, what, more == 1 ? "" : "s");
}

double number_of(const Vary& vary, const std::string& value) {
  double number = 0.0;
  const char* const end = value.data() + value.size();
  const auto read = std::from_chars(value.data(), end, number);
  if (read.ec == std::errc() && read.ptr == end) return number;
  return static_cast<double>(std::ranges::find(vary.values, value) - vary.values.begin());
}

SweepSummary summary_of(const Study& study, const Points& points, const Results& all) {
  SweepSummary summary;
  summary.points = points.size();
  summary.seeds_alike = seeds_are_alike(study, all);
  const Results fewer = summary.seeds_alike ? of_one_seed(study, all) : Results();
  const Results& results = summary.seeds_alike ? fewer : all;
  std::map<std::string, std::uint64_t> ends;
  for (const Variant& variant : study.variants) {
    summary.variants.emplace_back();
    summary.variants.back().variant = variant.name;
  }
  for (const auto& one : all) {
    if (!one) continue;
    ++summary.done;
    ++ends[one->ended];
  }
  for (std::size_t i = 0; i < results.size(); ++i) {
    if (!results[i]) continue;
    const PointResult& result = *results[i];
    const auto count = [&](PassRate& rate) {
      ++(was_refused(result) ? rate.refused : rate.all);
      rate.passed += result.passed ? 1 : 0;
    };
    count(summary.rate);
    if (!study.variants.empty()) count(summary.variants[i % study.variants.size()]);
    if (was_refused(result) && summary.refused_why.empty()) summary.refused_why = result.why();
  }
  summary.ends.assign(ends.begin(), ends.end());
  std::ranges::stable_sort(summary.ends, std::greater<>(),
                           &std::pair<std::string, std::uint64_t>::second);
  summary.worst = worst_of(study, points, all);
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
  f("why", "what puts it here: why it failed, or its least margin", point.why);
  f("more", "other points of its values that failed, too", point.more);
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
  f("points", "that count", one.points);
  f("without_margin", "of them failed without one: they count as the least", one.without_margin);
}

void figures(apps::Figures& f, const SweepSummary& s) {
  f("folder", "of the results", s.folder);
  f("directory", "in which the commands are typed", s.directory);
  f("points", "of the study", s.points);
  f("done", "points that have a result", s.done);
  f("seeds_alike", "the seeds change nothing: only the points of one of them count below",
    s.seeds_alike);
  f("refused_why", "why the first one was refused", s.refused_why);
  f("rate", "of all points", s.rate);
  f("variants", "the same of each variant", s.variants);
  f("worst", "ten at most", s.worst);
  f("comparisons", "each other variant with the first one", s.comparisons);
  f("ranking", "of keys, strongest first", s.ranking);
}

}  // namespace tandem::sweep
