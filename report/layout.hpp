// Where the parts of a figure stand, so that none lies on another: axes, numbers, labels, key.
// Layer: report.  Thread: non-RT only.
#pragma once

#include <cstddef>
#include <limits>
#include <vector>

#include "report/figure.hpp"

namespace tandem::report {

constexpr double kKeyFont = 12.0;  // points

/// Range of values along an axis; none: low > high.
struct Extent {
  double low = std::numeric_limits<double>::infinity();
  double high = -std::numeric_limits<double>::infinity();
  /// What is not finite is left out.
  void include(double value);
  /// A margin of `share` on both sides; at least something when all values are equal.
  void widen(double share);
};

/// Ranges of both axes, and where the numbers of y stand.
struct Axes {
  Extent x, y;
  double lowest_drawn = -std::numeric_limits<double>::infinity();  ///< no numbers below it
  double step = 0.0;                     ///< between numbers of y; 0: gnuplot chooses
  double lowest = 0.0;                   ///< of the numbers of y
  int decimals = 0;                      ///< of them
  std::vector<double> x_ticks, y_ticks;  ///< of logarithmic axes, some four or more
  std::size_t widest = 7;                ///< characters of the longest one
};

/// A part of a picture, in pixels from the picture's lower left corner.
struct Cell {
  double picture_width, picture_height;
  double left, bottom, width, height;
  double font;  ///< height of the letters' line [pixels] is 1.35 of it
};

/// Where things of one figure stand, in pixels as Cell.
struct FigureLayout {
  double left, right, bottom, top;  ///< of the axes
  double title_y, key_y, label_x;   ///< middle of the title, top of the key, middle of y's label
  double title_font;                ///< points
  std::size_t key_columns;
};

/// What the figure shows. What lies beyond range_until_x counts for y only if nothing else does.
[[nodiscard]] Axes axes_of(const Figure& figure);

/// The margins are what numbers, labels, title and key need, so that none lies on another.
[[nodiscard]] FigureLayout layout_of(const Figure& figure, const Axes& axes, const Cell& cell);

/// With equal axes the room beside the figure is shared on both sides.
void make_equal(Axes& axes, const FigureLayout& at);

}  // namespace tandem::report
