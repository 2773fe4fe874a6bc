// Kinds of ground in one table: a function of x and y with its derivatives.
#include "hal/config/terrain.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>

#include "hal/config/terrain_grid.hpp"

namespace tandem::hal {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kSteepestFade = 1.5;  // of fade()
constexpr double kFastestFade = 1.5;

/// A number and its derivative along one axis.
struct Along {
  double value, slope;
};

/// From 0 to 1 with s, smoothly: no kink at either end.
Along fade(double s) noexcept {
  if (s <= 0.0) return {0.0, 0.0};
  if (s >= 1.0) return {1.0, 0.0};
  return {s * s * (3.0 - 2.0 * s), 6.0 * s * (1.0 - s)};
}

/// 1 within the range, 0 beyond its edges.
Along within(const std::array<double, 2>& range, double edge_m, double at) noexcept {
  const double below = range[0] - at, above = at - range[1];
  if (below <= 0.0 && above <= 0.0) return {1.0, 0.0};
  const Along down = fade(1.0 - std::max(below, above) / edge_m);
  return {down.value, (above > 0.0 ? -down.slope : down.slope) / edge_m};
}

/// A hill over the range, smooth at its ends.
Along hill(const std::array<double, 2>& range, double at) noexcept {
  const double length = range[1] - range[0], s = (at - range[0]) / length;
  if (!(s > 0.0 && s < 1.0)) return {0.0, 0.0};
  return {0.5 * (1.0 - std::cos(2.0 * kPi * s)), kPi / length * std::sin(2.0 * kPi * s)};
}

Surface times(const Along& x, const Along& y, const Surface& high) noexcept {
  return {high.height_m * x.value * y.value,
          high.along_x * x.value * y.value + high.height_m * x.slope * y.value,
          high.along_y * x.value * y.value + high.height_m * x.value * y.slope};
}

/// The corner or side of the rectangle from which a slope rises; W's origin where it has none.
double low_end(const std::array<double, 2>& range, double direction) noexcept {
  const double end = direction < 0.0 ? range[1] : range[0];
  return std::isfinite(end) ? end : 0.0;
}

Surface slope(const GroundShape& shape, double x, double y) noexcept {
  const double rise = std::tan(shape.slope_rad);
  const double cx = std::cos(shape.towards_rad), cy = std::sin(shape.towards_rad);
  const double way = cx * (x - low_end(shape.x_m, cx)) + cy * (y - low_end(shape.y_m, cy));
  return times(within(shape.x_m, shape.edge_m, x), within(shape.y_m, shape.edge_m, y),
               {rise * way, rise * cx, rise * cy});
}

Surface step(const GroundShape& shape, double x, double y) noexcept {
  return times(within(shape.x_m, shape.edge_m, x), within(shape.y_m, shape.edge_m, y),
               {shape.height_m, 0.0, 0.0});
}

Surface bump(const GroundShape& shape, double x, double y) noexcept {
  return times(hill(shape.x_m, x), hill(shape.y_m, y), {shape.height_m, 0.0, 0.0});
}

double steepest_step(const GroundShape& shape) {
  return std::numbers::sqrt2 * kSteepestFade * std::abs(shape.height_m) / shape.edge_m;
}

double steepest_bump(const GroundShape& shape) {
  const auto along = [&](const std::array<double, 2>& range) {
    return kPi * std::abs(shape.height_m) / (range[1] - range[0]);
  };
  return std::hypot(along(shape.x_m), along(shape.y_m));
}

/// On the slope, or down its highest edge.
double steepest_slope(const GroundShape& shape) {
  const double rise = std::abs(std::tan(shape.slope_rad));
  const auto way = [&](const std::array<double, 2>& range, double direction) {
    const double reach = std::isfinite(range[0]) && std::isfinite(range[1])
                             ? range[1] - range[0] + shape.edge_m
                             : 0.0;
    return std::abs(direction) * reach;
  };
  const double high = rise * (way(shape.x_m, std::cos(shape.towards_rad)) +
                              way(shape.y_m, std::sin(shape.towards_rad)));
  return rise + std::numbers::sqrt2 * kSteepestFade * high / shape.edge_m;
}

/// `parts` + 1 places from `from` to `to`.
void add_parts(double from, double to, int parts, std::vector<double>& places) {
  for (int i = 0; i <= parts && std::isfinite(from) && std::isfinite(to); ++i)
    places.push_back(std::lerp(from, to, static_cast<double>(i) / parts));
}

/// Both edges of a step or slope, on which its height fades.
void edge_lines(const std::array<double, 2>& range, double edge_m, std::vector<double>& places) {
  constexpr int kParts = 6;
  add_parts(range[0] - edge_m, range[0], kParts, places);
  add_parts(range[1], range[1] + edge_m, kParts, places);
}

void hill_lines(const std::array<double, 2>& range, double, std::vector<double>& places) {
  constexpr int kParts = 24;
  add_parts(range[0], range[1], kParts, places);
}

struct Kind {
  Surface (*at)(const GroundShape&, double x, double y) noexcept;
  double (*steepest)(const GroundShape&);
  void (*lines)(const std::array<double, 2>& range, double edge_m, std::vector<double>& places);
};

constexpr Kind kKinds[] = {
    {&slope, &steepest_slope, &edge_lines},
    {&step, &steepest_step, &edge_lines},
    {&bump, &steepest_bump, &hill_lines},
};

const Kind& kind_of(const GroundShape& shape) noexcept {
  return kKinds[static_cast<std::size_t>(shape.kind)];
}

}  // namespace

void Terrain::add(const GroundShape& shape) {
  shapes_.push_back(shape);
  steepest_ += kind_of(shape).steepest(shape);
}

void Terrain::add(const GroundShake& shake) {
  shakes_.push_back(shake);
  // d/dt of fade(f t) sin(2 pi f t)
  fastest_m_s_ +=
      std::abs(shake.amplitude_m) * shake.frequency_Hz * (2.0 * kPi + 2.0 * kFastestFade);
}

Surface Terrain::at(double x_m, double y_m) const noexcept TANDEM_RT {
  Surface all;
  for (const GroundShape& shape : shapes_) all += kind_of(shape).at(shape, x_m, y_m);
  return all;
}

void add_lines(const Terrain& terrain, std::size_t axis, std::vector<double>& places_m) {
  for (const GroundShape& shape : terrain.shapes())
    kind_of(shape).lines(axis == 0 ? shape.x_m : shape.y_m, shape.edge_m, places_m);
}

GroundMotion Terrain::motion_at(double time_s) const noexcept TANDEM_RT {
  GroundMotion motion;
  for (const GroundShake& shake : shakes_) {
    const double since_s = time_s - shake.from_s, left_s = shake.for_s - since_s;
    if (!(since_s > 0.0) || !(left_s > 0.0)) continue;
    const double f = shake.frequency_Hz, turn = 2.0 * kPi * f;
    const Along in = fade(f * since_s), out = fade(f * left_s);
    const double share = in.value * out.value;
    const double share_rate = f * (in.slope * out.value - in.value * out.slope);
    const double sine = std::sin(turn * since_s), cosine = std::cos(turn * since_s);
    const double way = shake.amplitude_m * share * sine;
    const double rate = shake.amplitude_m * (share_rate * sine + share * turn * cosine);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      motion.position_m[axis] += way * shake.along[axis];
      motion.velocity_m_s[axis] += rate * shake.along[axis];
    }
  }
  return motion;
}

}  // namespace tandem::hal
