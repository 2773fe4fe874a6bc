// The points of collision shapes that would touch a level ground first.
// Layer: scaffold, private to feet.cpp.  Thread: any, non-RT.
#pragma once

#include <string>
#include <vector>

#include "model/tree.hpp"
#include "scaffold/posed.hpp"

namespace tandem::scaffold {

using model::Shape;

/// In W. A lone ball has one point, its centre, and a radius.
struct ContactPatch {
  std::vector<Eigen::Vector3d> points;
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();  ///< the sole's normal, into the foot
  double radius_m = 0.0;
};

/// The lowest points of the shapes, at most eight of them. Empty without a usable shape.
[[nodiscard]] ContactPatch lowest_points(const std::vector<Shape>& shapes,
                                         const std::vector<model::Placement>& links);

/// The sole of a box with the link's mass and inertia: what to assume of a foot without shapes.
/// @param scale_m  the leg's length, which bounds the guess
[[nodiscard]] ContactPatch equivalent_sole(const model::Inertia& in_w, const Eigen::Vector3d& ankle,
                                           double scale_m);

}  // namespace tandem::scaffold
