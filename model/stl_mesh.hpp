// Triangles of an STL file, and the mass of what they enclose.
// Layer: model.  Thread: any, non-RT.
#pragma once

#include <Eigen/Core>
#include <array>
#include <string_view>
#include <vector>

#include "base/result.hpp"
#include "model/tree.hpp"

namespace tandem::model {

using Triangle = std::array<Eigen::Vector3d, 3>;

/// Binary or text. Errors: no STL; cut off; numbers that are not finite.
[[nodiscard]] Result<std::vector<Triangle>> parse_stl(std::string_view bytes);

/// The solid within a closed surface, in the triangles' frame: exact, by tetrahedra (Mirtich
/// 1996 has the integrals). @return mass 0 where the surface encloses nothing, as an open one may
[[nodiscard]] Inertia solid_within(const std::vector<Triangle>& surface, double density_kg_m3);

}  // namespace tandem::model
