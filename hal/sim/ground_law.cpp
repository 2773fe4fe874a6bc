// The law on ground that is inclined or moves: the level one's, in the axes of the place.
#include "hal/sim/ground_law.hpp"

#include "hal/sim/tree_motion.hpp"

namespace tandem::sim {

std::array<double, 3> terrain_force(const hal::ContactConfig& config,
                                    const hal::GroundMotion& moved, const PointGround& ground,
                                    const PointMotion& point, bool move_anchor,
                                    const Anchor& anchor, double& energy_J) noexcept {
  const double x = point.px - moved.position_m[0], y = point.py - moved.position_m[1];
  const hal::Surface place = config.terrain.at(x, y);
  const double above = point.pz - moved.position_m[2] - config.height_m - place.height_m;
  if (!(above < 0.0)) {
    if (move_anchor) *anchor.touching = 0;
    return {};
  }
  const double gx = place.along_x, gy = place.along_y;
  const double up = 1.0 / std::sqrt(1.0 + gx * gx + gy * gy);
  const double ahead = 1.0 / std::sqrt(1.0 + gx * gx);
  const Vec3 normal{-gx * up, -gy * up, up}, first{ahead, 0.0, gx * ahead};
  const Vec3 second = cross(normal, first);
  const double depth = -above * up;
  const Vec3 rate{point.vx - moved.velocity_m_s[0], point.vy - moved.velocity_m_s[1],
                  point.vz - moved.velocity_m_s[2]};
  // The place on the surface that is next to the point, and the way to it along the surface.
  const double at_x = x + depth * normal[0], at_y = y + depth * normal[1];
  const double dx = at_x - *anchor.x, dy = at_y - *anchor.y;
  const Vec3 way{dx, dy, gx * dx + gy * dy};
  const Press press{depth,
                    dot(rate, normal.data()),
                    dot(way, first.data()),
                    dot(way, second.data()),
                    dot(rate, first.data()),
                    dot(rate, second.data())};
  const PressForce force =
      press_force(config, ground, press, *anchor.touching != 0, x, y, energy_J);
  if (move_anchor) {
    *anchor.touching = 1;
    *anchor.x = at_x - force.stretch_x * first[0] - force.stretch_y * second[0];
    *anchor.y = at_y - force.stretch_x * first[1] - force.stretch_y * second[1];
  }
  std::array<double, 3> in_W{};
  for (std::size_t i = 0; i < 3; ++i)
    in_W[i] = force.x * first[i] + force.y * second[i] + force.normal * normal[i];
  return in_W;
}

}  // namespace tandem::sim
