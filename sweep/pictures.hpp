// The page's pictures of one expectation, in SVG: how its margins spread, and over what varies.
// Layer: sweep.  Thread: any.
#pragma once

#include <string>
#include <vector>

#include "sweep/study.hpp"
#include "sweep/summary.hpp"
#include "sweep/table.hpp"

namespace tandem::sweep {

/// How many points have which margin; those that failed in the other color. Those that failed
/// without one are a bar of their own, at the left.
/// @pre !points.empty()
[[nodiscard]] std::string histogram(const std::vector<MarginOfPoint>& points,
                                    const NamedMargin& margin);

/// The margin over what varies: full dots failed. Those that failed without one are on a lane of
/// their own, below.
/// @param x  of `points`, as number_of() has it  @pre x.size() == points.size(), not empty
[[nodiscard]] std::string scatter(const std::vector<MarginOfPoint>& points, std::vector<double> x,
                                  const NamedMargin& margin, const Vary& vary);

/// Two numbers with as many digits as tell them, and what lies between them, apart.
[[nodiscard]] std::pair<std::string, std::string> ends_in_words(double low, double high);

/// For a page: harmless, and with its entities.
[[nodiscard]] std::string text_in_page(const std::string& text);

}  // namespace tandem::sweep
