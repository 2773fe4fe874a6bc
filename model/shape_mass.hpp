// Masses of links that have none, from their shapes and a density.
// Layer: model.  Thread: any, non-RT.
#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/result.hpp"
#include "model/tree.hpp"

namespace tandem::model {

struct ShapeMass {
  std::string link;
  Inertia inertia;   ///< in the link's frame
  std::string from;  ///< "2 boxes", "1 mesh"
};

inline constexpr const char* kNoShape = "it has no <collision> and no <visual>";

struct ShapeMasses {
  std::vector<ShapeMass> links;
  /// Links without mass that stay so, and why: "tool: its mesh tool.dae is no STL".
  std::vector<std::pair<std::string, std::string>> without;
  Diagnostics errors;  ///< shapes that are larger than any robot's: in millimetres, most likely
};

/// The masses of links that have no <inertial>, or mass 0: from collision shapes, or visual ones
/// where a link has none of those. Boxes, cylinders, spheres and capsules are solid, and so is what
/// a mesh (STL) encloses; one that encloses nothing possible counts as the box around it. Shapes
/// that overlap count twice.
/// @param file  of the description: meshes are looked for beside it, and package://NAME/… in the
///              folders above it
[[nodiscard]] ShapeMasses masses_from_shapes(std::string_view text, const std::string& file,
                                             double density_kg_m3);

}  // namespace tandem::model
