// The shape and the motion of the simulated ground: [[sim.ground]] and [[sim.shake]].
// Layer: hal/config.  Thread: non-RT to fill; at() and motion_at() any.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include "base/realtime.hpp"

namespace tandem::hal {

/// A place's height over the level ground, and how it rises along W's x and y.
struct Surface {
  double height_m = 0.0, along_x = 0.0, along_y = 0.0;

  Surface& operator+=(const Surface& other) noexcept {
    height_m += other.height_m;
    along_x += other.along_x;
    along_y += other.along_y;
    return *this;
  }
};

/// Rows of terrain.cpp's table, in its order.
enum class GroundShapeKind : std::uint8_t { kSlope, kStep, kBump };
inline constexpr std::string_view kGroundShapes = "slope|step|bump";

/// [[sim.ground]]: a rectangle whose ground is higher, lower or inclined.
struct GroundShape {
  static constexpr double kEverywhere = std::numeric_limits<double>::infinity();

  std::string name;
  GroundShapeKind kind = GroundShapeKind::kSlope;
  std::array<double, 2> x_m{-kEverywhere, kEverywhere}, y_m{-kEverywhere, kEverywhere};
  double height_m = 0.0;     ///< of a step or bump; negative: a hole
  double slope_rad = 0.0;    ///< of a slope
  double towards_rad = 0.0;  ///< where it rises to, from W's x axis to its y axis
  double edge_m = 0.02;      ///< outside the rectangle: how far it is down to the level
};

/// [[sim.shake]]: the whole ground moves along an axis, as amplitude_m sin(2 pi f t). It fades in
/// within its first period and out within its last one, so its velocity has no jump.
struct GroundShake {
  std::string name;
  std::array<double, 3> along{};  ///< in W, of length 1
  double amplitude_m = 0.0, frequency_Hz = 1.0;
  double from_s = 0.0;
  double for_s = std::numeric_limits<double>::infinity();
};

/// Where the ground is, and how fast it moves. In W.
struct GroundMotion {
  std::array<double, 3> position_m{}, velocity_m_s{};
};

/// The ground is level and still where nothing is added. Heights of shapes that overlap add up.
class Terrain {
 public:
  void add(const GroundShape& shape);
  void add(const GroundShake& shake);

  /// Whether it is the plane z = height, for good.
  [[nodiscard]] bool level() const noexcept { return shapes_.empty() && shakes_.empty(); }
  [[nodiscard]] bool moves() const noexcept { return !shakes_.empty(); }

  /// At a place of the ground, which moves along with it.
  [[nodiscard]] Surface at(double x_m, double y_m) const noexcept TANDEM_RT;
  /// At a time since the first SYNC.
  [[nodiscard]] GroundMotion motion_at(double time_s) const noexcept TANDEM_RT;
  /// No place is steeper, and it never moves faster.
  [[nodiscard]] double steepest() const noexcept { return steepest_; }
  [[nodiscard]] double fastest_m_s() const noexcept { return fastest_m_s_; }

  [[nodiscard]] const std::vector<GroundShape>& shapes() const noexcept { return shapes_; }
  [[nodiscard]] const std::vector<GroundShake>& shakes() const noexcept { return shakes_; }

 private:
  std::vector<GroundShape> shapes_;
  std::vector<GroundShake> shakes_;
  double steepest_ = 0.0, fastest_m_s_ = 0.0;
};

}  // namespace tandem::hal
