// Curves broken where samples are missing, and thinned to what a plot can show, with each
// interval's extremes kept.
#include "report/figure.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace tandem::report {
namespace {

constexpr double kNoValue = std::numeric_limits<double>::quiet_NaN();

/// The extremes of `bins` runs of the samples [begin, end), none of which is NaN.
void add_extremes(const Curve& curve, std::size_t begin, std::size_t end, std::size_t bins,
                  Curve& out) {
  const std::size_t samples = end - begin;
  for (std::size_t bin = 0; bin < bins; ++bin) {
    const auto at = [&](std::size_t edge) {
      return curve.y.begin() + static_cast<std::ptrdiff_t>(begin + edge * samples / bins);
    };
    const auto [low, high] = std::minmax_element(at(bin), at(bin + 1));
    const auto a = static_cast<std::size_t>(low - curve.y.begin());
    const auto b = static_cast<std::size_t>(high - curve.y.begin());
    for (const std::size_t i : {std::min(a, b), std::max(a, b)}) {
      out.x.push_back(curve.x[i]);
      out.y.push_back(curve.y[i]);
    }
  }
}

}  // namespace

void drop_empty_curves(Figure& figure) {
  std::erase_if(figure.curves, [](const Curve& curve) {
    return std::ranges::none_of(curve.y, [](double y) { return std::isfinite(y); });
  });
}

double usual_step(std::span<const double> x) {
  std::vector<double> steps;
  for (std::size_t i = 1; i < x.size(); ++i) steps.push_back(x[i] - x[i - 1]);
  if (steps.empty()) return 0.0;
  const auto middle = steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2);
  std::ranges::nth_element(steps, middle);
  return *middle;
}

std::vector<std::size_t> stretches(std::span<const double> x) {
  const double longest = kGapSteps * usual_step(x);
  std::vector<std::size_t> begins{0};
  for (std::size_t i = 1; i < x.size(); ++i) {
    if (x[i] < x[i - 1] || x[i] - x[i - 1] > longest) begins.push_back(i);
  }
  return begins;
}

void break_at_gaps(Figure& figure) {
  for (Curve& curve : figure.curves) {
    const std::vector<std::size_t> begins = stretches(curve.x);
    for (auto begin = begins.rbegin(); begin + 1 != begins.rend(); ++begin) {
      const auto at = static_cast<std::ptrdiff_t>(*begin);
      curve.x.insert(curve.x.begin() + at, curve.x[*begin]);
      curve.y.insert(curve.y.begin() + at, kNoValue);
    }
  }
}

std::string key_text(const Curve& curve) {
  if (curve.log == 0 || curve.label.empty()) return curve.label;
  return curve.label + ", " + curve.log;
}

Curve decimated(const Curve& curve, std::size_t most) {
  if (curve.x.size() <= most || most < 4) return curve;
  Curve out{curve.label, curve.style, {}, {}, curve.log};
  const std::size_t bins = most / 2;
  for (std::size_t begin = 0; begin < curve.x.size();) {
    std::size_t end = begin;
    while (end < curve.x.size() && !std::isnan(curve.y[end])) ++end;
    if (end - begin > 1) {  // of a single one there is no line
      const std::size_t share = bins * (end - begin) / curve.x.size();
      add_extremes(curve, begin, end, std::max<std::size_t>(1, share), out);
    }
    if (end < curve.x.size() && !out.y.empty() && !std::isnan(out.y.back())) {
      out.x.push_back(curve.x[end]);
      out.y.push_back(kNoValue);
    }
    begin = end + 1;
  }
  return out;
}

}  // namespace tandem::report
