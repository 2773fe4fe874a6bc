// The force of the ground on one point. docs/simulation.md has the equations.
// Layer: hal/sim.  Thread: any.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

#include "hal/config/robot_config.hpp"

namespace tandem::sim {

/// What the ground is to one point, beside friction.
struct PointGround {
  double stiffness_N_m = 0.0;
  double damping_s_m = 0.0;  ///< Fz = k d (1 + damping * d'), never below zero
  double most_damping_Ns_m = std::numeric_limits<double>::infinity();  ///< of k d damping
  double tangential_stiffness_N_m = 0.0;
  double tangential_damping_Ns_m = 0.0;
};

/// Position and velocity of a point in W.
struct PointMotion {
  double px, py, pz, vx, vy, vz;
};

/// Where a point is tied to the ground.
struct Anchor {
  double* x;
  double* y;
  std::uint8_t* touching;
};

/// Shortens (x, y) to `length` when it is longer.
inline void cut_to(double length, double& x, double& y) noexcept {
  const double square = x * x + y * y;
  if (square <= length * length) return;
  const double scale = length / std::sqrt(square);
  x *= scale;
  y *= scale;
}

/// How a point presses on the ground, in axes of the ground's own: two along it, one away from it.
struct Press {
  double depth, rate;       ///< rate: out of the ground
  double way_x, way_y;      ///< from the anchor
  double speed_x, speed_y;  ///< over the ground
};
/// The force in those axes, and how far the spring to the anchor is stretched.
struct PressForce {
  double x, y, normal;
  double stretch_x, stretch_y;
};

/// The law of class Contact.
/// @param x, y  the place, for patches
/// @pre press.depth > 0
inline PressForce press_force(const hal::ContactConfig& config, const PointGround& ground,
                              const Press& press, bool anchored, double x, double y,
                              double& energy_J) noexcept {
  double share = 1.0, most = config.static_friction, least = config.sliding_friction;
  for (const hal::GroundPatch& patch : config.patches) {
    if (!patch.holds(x, y)) continue;
    share = patch.stiffness_share;
    most = patch.static_friction;
    least = patch.sliding_friction;
    break;
  }
  const double elastic = share * ground.stiffness_N_m * press.depth;
  const double damping = std::min(ground.damping_s_m, ground.most_damping_Ns_m / elastic);
  const double normal = std::max(0.0, elastic * (1.0 - damping * press.rate));
  const double speed2 = press.speed_x * press.speed_x + press.speed_y * press.speed_y;
  const double stick2 = config.stick_velocity_m_s * config.stick_velocity_m_s;
  const double mu = least + (most - least) * stick2 / (stick2 + speed2);
  const double cone = mu * normal;
  // A point that came down since the last sub-step is anchored where it is now.
  const double kt = share * ground.tangential_stiffness_N_m;
  double fx = anchored ? -kt * press.way_x : 0.0;
  double fy = anchored ? -kt * press.way_y : 0.0;
  cut_to(cone, fx, fy);
  const double stretch_x = -fx / kt, stretch_y = -fy / kt;
  fx -= ground.tangential_damping_Ns_m * press.speed_x;
  fy -= ground.tangential_damping_Ns_m * press.speed_y;
  cut_to(cone, fx, fy);
  energy_J += 0.5 * (elastic * press.depth + kt * (stretch_x * stretch_x + stretch_y * stretch_y));
  return {fx, fy, normal, stretch_x, stretch_y};
}

/// Ground that is not level, or moves: force on a point, in W. Depth is measured along the normal
/// of the place, and the anchor moves along with the ground.
[[nodiscard]] std::array<double, 3> terrain_force(const hal::ContactConfig& config,
                                                  const hal::GroundMotion& moved,
                                                  const PointGround& ground,
                                                  const PointMotion& point, bool move_anchor,
                                                  const Anchor& anchor, double& energy_J) noexcept;

/// The ground's force on a point, in W; class Contact has the law.
///
/// @param moved        where the ground is; not read where it stands still
/// @param move_anchor  true exactly once per sub-step, at its first evaluation
/// @param energy_J     what the point's springs hold is added
inline std::array<double, 3> ground_force(const hal::ContactConfig& config,
                                          const hal::GroundMotion& moved, const PointGround& ground,
                                          const PointMotion& point, bool move_anchor,
                                          const Anchor& anchor, double& energy_J) noexcept {
  if (!config.terrain.level())
    return terrain_force(config, moved, ground, point, move_anchor, anchor, energy_J);
  const double depth = config.height_m - point.pz;
  if (!(depth > 0.0)) {
    if (move_anchor) *anchor.touching = 0;
    return {};
  }
  const Press press{depth,    point.vz, point.px - *anchor.x, point.py - *anchor.y,
                    point.vx, point.vy};
  const PressForce force =
      press_force(config, ground, press, *anchor.touching != 0, point.px, point.py, energy_J);
  if (move_anchor) {
    *anchor.touching = 1;
    *anchor.x = point.px - force.stretch_x;
    *anchor.y = point.py - force.stretch_y;
  }
  return {force.x, force.y, force.normal};
}

}  // namespace tandem::sim
