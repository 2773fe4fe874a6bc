#include "hal/config/terrain_grid.hpp"

#include <algorithm>
#include <cmath>

namespace tandem::hal {
namespace {

/// Leaves out lines that are less than `apart_m` behind the one before; the last one stays.
std::vector<double> thinned(const std::vector<double>& lines, double apart_m) {
  std::vector<double> kept{lines.front()};
  for (const double line : lines) {
    if (line - kept.back() >= apart_m && lines.back() - line >= apart_m) kept.push_back(line);
  }
  kept.push_back(lines.back());
  return kept;
}

/// @param coarser  set where there would be too many
std::vector<double> lines_of(const Terrain& terrain, std::size_t axis, bool& coarser) {
  constexpr double kBeside_m = 1.0, kSame_m = 1e-6;
  std::vector<double> lines;
  add_lines(terrain, axis, lines);
  std::ranges::sort(lines);
  double from_m = -TerrainGrid::kLeast_m, to_m = TerrainGrid::kLeast_m;
  if (!lines.empty()) {
    from_m = std::max(-TerrainGrid::kMost_m, std::min(from_m, lines.front() - kBeside_m));
    to_m = std::min(TerrainGrid::kMost_m, std::max(to_m, lines.back() + kBeside_m));
  }
  std::erase_if(lines, [&](double line) { return line <= from_m || line >= to_m; });
  lines.insert(lines.begin(), from_m);
  lines.push_back(to_m);
  std::vector<double> kept = thinned(lines, kSame_m);
  coarser = coarser || kept.size() > TerrainGrid::kMostLines;
  for (double apart_m = 1e-3; kept.size() > TerrainGrid::kMostLines; apart_m *= 1.5)
    kept = thinned(lines, apart_m);
  return kept;
}

}  // namespace

TerrainGrid grid_of(const Terrain& terrain) {
  TerrainGrid grid;
  grid.x_m = lines_of(terrain, 0, grid.coarser);
  grid.y_m = lines_of(terrain, 1, grid.coarser);
  grid.height_m.reserve(grid.x_m.size() * grid.y_m.size());
  for (const double y : grid.y_m)
    for (const double x : grid.x_m) grid.height_m.push_back(terrain.at(x, y).height_m);
  return grid;
}

}  // namespace tandem::hal
