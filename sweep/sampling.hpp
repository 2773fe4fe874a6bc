// Where a study's points lie: distributions of one value, and methods that spread many.
// Layer: sweep.  Thread: any.
#pragma once

#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

namespace tandem::sweep {

/// How a value is distributed, by two numbers: a row of distributions().
struct Distribution {
  std::string_view name;   ///< key of a [[vary]]
  std::string_view words;  ///< what the two numbers are
  /// Why the two are none; empty: they are.
  std::string_view (*problem)(double a, double b);
  /// The value below which a share `u` of all is, 0 < u < 1.
  double (*at)(double u, double a, double b);
  bool logarithmic = false;  ///< its axis
};
[[nodiscard]] std::span<const Distribution> distributions();

/// How points are spread in the unit cube: a row of methods().
struct Method {
  std::string_view name;  ///< [sample] method
  std::string_view words;
  bool is_grid = false;           ///< every combination; the others take [sample] points
  std::size_t most_keys = 1'000;  ///< that it can spread
  /// Coordinates of all points, 0 < u < 1, point by point; null of the grid.
  std::vector<double> (*spread)(std::size_t points, std::size_t keys, std::uint64_t seed) = nullptr;
};
[[nodiscard]] std::span<const Method> methods();

}  // namespace tandem::sweep
