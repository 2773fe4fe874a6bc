// Whether masses and inertias of a tree are physically possible.
// Layer: model, private to urdf*.cpp.  Thread: non-RT only.
#pragma once

#include <string>

#include "base/result.hpp"
#include "model/tree.hpp"
#include "model/urdf.hpp"
#include "model/urdf_outline.hpp"

namespace tandem::model {

/// Whether the inertia is that of a body larger than any robot: it says nothing of the shape.
[[nodiscard]] bool is_beyond_size(double mass_kg, const Eigen::Matrix3d& about_com_kg_m2);

/// "0.01, 0.02, 0.02 kg m^2": the principal moments, ascending.
[[nodiscard]] std::string moments_text(const Inertia& inertia);

/// Checks every link (those of negligible mass give warnings), every body and that each moving
/// joint carries mass; nothing of what is fixed to the world. Errors and warnings name the link or
/// joint with its line, or what overrides it.
void check_inertias(const Tree& tree, const Outline& outline, const UrdfOptions& options,
                    Diagnostics& errors, Diagnostics& warnings);

/// What can be said of links' inertias where the joints make no tree: that they are impossible,
/// unless the link may be a negligible one.
[[nodiscard]] Diagnostics impossible_links(const Outline& outline, const std::string& file);

}  // namespace tandem::model
