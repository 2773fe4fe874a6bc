// Right angles that a description writes with few digits: 1.5708 is 3.7e-6 rad off, and costs the
// operations of a turn where a right angle costs none.
// Layer: model.  Thread: non-RT.
#pragma once

#include <string>

#include "model/tree.hpp"

namespace tinyxml2 {
class XMLElement;
}

namespace tandem::model {

/// Entries of rotations and axes within so much of 0 or +-1 are set to it: rounding of a right
/// angle with 14 digits or more, and of products of such rotations.
inline constexpr double kExactRightAngle = 1e-14;
/// An angle is taken for a right one, written with few digits, within so much.
inline constexpr double kNearRightAngle_rad = 1e-5;
/// Within so much it may have been meant as one (1.57 is 8e-4 off), or measured: never changed.
inline constexpr double kPerhapsRightAngle_rad = 2e-3;

/// What a description has of them: multiples of 90 degrees in `rpy`, coordinate axes in `axis`.
struct RightAngles {
  int count = 0;           ///< numbers or axes that are near one and not exact
  double worst_rad = 0.0;  ///< how far the furthest is off
  // Turns by about 90, 180 or 270 degrees that are further off.
  int perhaps = 0;                 ///< numbers in `rpy`
  double perhaps_worst_rad = 0.0;  ///< how far the furthest is off
  std::string perhaps_first;       ///< the joint or link of the first
};

/// Looks at an <origin>'s rpy or an <axis>' xyz, counts what is near, and writes it exactly when
/// asked. Attributes that are missing or no numbers are left alone.
void look_at_rpy(tinyxml2::XMLElement* origin, bool make_exact, RightAngles& found);
void look_at_axis(tinyxml2::XMLElement* axis, bool make_exact, RightAngles& found);

/// How far a link moves at most when the angles of `written` become those of `exact`, which is the
/// same description otherwise, in any posture (prismatic joints at 0).
struct Displacement {
  std::string link;
  double distance_m = 0.0;
};
[[nodiscard]] Displacement largest_displacement(const Tree& written, const Tree& exact);

}  // namespace tandem::model
