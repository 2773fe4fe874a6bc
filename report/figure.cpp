// Curves thinned to what a plot can show, with each interval's extremes kept.
#include "report/figure.hpp"

#include <algorithm>

namespace tandem::report {

Curve decimated(const Curve& curve, std::size_t most) {
  if (curve.x.size() <= most || most < 4) return curve;
  Curve out{curve.label, curve.style, {}, {}};
  const std::size_t bins = most / 2;
  for (std::size_t bin = 0; bin < bins; ++bin) {
    const std::size_t begin = bin * curve.x.size() / bins;
    const std::size_t end = (bin + 1) * curve.x.size() / bins;
    const auto first = curve.y.begin();
    const auto [low, high] = std::minmax_element(first + static_cast<std::ptrdiff_t>(begin),
                                                 first + static_cast<std::ptrdiff_t>(end));
    const auto a = static_cast<std::size_t>(low - first);
    const auto b = static_cast<std::size_t>(high - first);
    for (const std::size_t i : {std::min(a, b), std::max(a, b)}) {
      out.x.push_back(curve.x[i]);
      out.y.push_back(curve.y[i]);
    }
  }
  return out;
}

}  // namespace tandem::report
