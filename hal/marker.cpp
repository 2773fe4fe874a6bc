#include "hal/marker.hpp"

#include <algorithm>
#include <cmath>
#include <span>
#include <string_view>

#include "base/quoting.hpp"

namespace tandem::hal {
namespace {

using Place = std::array<double, 3>;

std::int32_t marker_type(MarkShape shape) {
  switch (shape) {
    case MarkShape::kPoints: return 7;  // SPHERE_LIST
    case MarkShape::kArrow: return 0;
    case MarkShape::kLine:
    case MarkShape::kPolygon: return 4;  // LINE_STRIP
    case MarkShape::kText: return 9;     // TEXT_VIEW_FACING
  }
  return 7;
}

/// What is not whole yet, or has a place that is no number, is of no use to a viewer: no places.
std::span<const Place> shown_places(const MarkInfo& mark, const MarkBlock::State& state,
                                    std::size_t index) {
  const std::size_t points =
      state.drawn == 0 ? 0 : std::min<std::size_t>(state.marks[index].points, mark.points);
  const auto places = std::span(state.place_m).subspan(mark.first, points);
  const bool finite = std::ranges::all_of(places, [](const Place& place) {
    return std::ranges::all_of(place, [](double value) { return std::isfinite(value); });
  });
  return finite && points >= (mark.shape == MarkShape::kArrow ? 2U : 1U) ? places : places.first(0);
}

/// Turns about the fixed axes x, y, z, in this order: x, y, z, w.
std::array<double, 4> quaternion_of(const std::array<double, 3>& rpy_rad) {
  const auto [r, p, y] = rpy_rad;
  const double cr = std::cos(r / 2), sr = std::sin(r / 2), cp = std::cos(p / 2),
               sp = std::sin(p / 2), cy = std::cos(y / 2), sy = std::sin(y / 2);
  return {sr * cp * cy - cr * sp * sy, cr * sp * cy + sr * cp * sy, cr * cp * sy - sr * sp * cy,
          cr * cp * cy + sr * sp * sy};
}

/// origin + R(q) at
Place moved(const Place& origin, const std::array<double, 4>& q, const Place& at) {
  const auto cross = [](const Place& a, const Place& b) {
    return Place{a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
  };
  const Place axis{q[0], q[1], q[2]}, once = cross(axis, at), twice = cross(axis, once);
  Place out = origin;
  for (std::size_t i = 0; i < 3; ++i) out[i] += at[i] + 2.0 * (q[3] * once[i] + twice[i]);
  return out;
}

}  // namespace

Marker marker_of(const MarkInfo& mark, const MarkBlock::State& state, std::size_t index) {
  const auto places = shown_places(mark, state, index);
  const bool is_text = mark.shape == MarkShape::kText, is_arrow = mark.shape == MarkShape::kArrow;
  Marker marker;
  marker.type = marker_type(mark.shape);
  marker.action = places.empty() ? Marker::kDelete : Marker::kAdd;
  marker.quaternion = quaternion_of(mark.rpy_rad);
  marker.position_m = mark.xyz_m;
  marker.scale_m = {mark.size_m, is_arrow ? 2.0 * mark.size_m : mark.size_m,
                    is_arrow ? 0.0 : mark.size_m};
  if (is_text) {
    if (!places.empty()) marker.position_m = moved(mark.xyz_m, marker.quaternion, places.front());
    const auto& chars = state.marks[index].text;
    const std::string_view said(chars.data(), chars.size());
    marker.text = shown(said.substr(0, said.find('\0')));
    return marker;
  }
  marker.points_m.assign(places.begin(), places.end());
  if (mark.shape == MarkShape::kPolygon && places.size() > 1)
    marker.points_m.push_back(places.front());
  return marker;
}

}  // namespace tandem::hal
