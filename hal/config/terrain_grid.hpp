// The heights of a terrain on a grid, for pictures.
// Layer: hal/config.  Thread: non-RT.
#pragma once

#include <cstddef>
#include <vector>

#include "hal/config/terrain.hpp"

namespace tandem::hal {

/// Lines along both axes, and the heights where they cross: between them the ground is straight, or
/// nearly so.
struct TerrainGrid {
  static constexpr std::size_t kMostLines = 160;  ///< of each axis
  static constexpr double kLeast_m = 10.0;        ///< from W's origin: what is drawn in any case
  static constexpr double kMost_m = 100.0;        ///< what is farther away is left out

  std::vector<double> x_m, y_m;  ///< in W where the ground has not moved, ascending
  std::vector<double> height_m;  ///< over the level ground; of each y the x_m.size() of its row
  bool coarser = false;          ///< there are more lines than kMostLines: close ones are left out
};

[[nodiscard]] TerrainGrid grid_of(const Terrain& terrain);

/// Appends the places along x (axis 0) or y between which heights are straight, or nearly so.
void add_lines(const Terrain& terrain, std::size_t axis, std::vector<double>& places_m);

}  // namespace tandem::hal
