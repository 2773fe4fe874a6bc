// Masses and inertias that a body can have, but that this robot's links hardly do.
// Layer: model, private to urdf*.cpp.  Thread: non-RT only.
#pragma once

#include "base/result.hpp"
#include "model/tree.hpp"
#include "model/urdf_outline.hpp"

namespace tandem::model {

/// One warning for each kind, with the first link and the number of the others: no mass between
/// two joints that move; a radius of gyration beyond the link; a link far denser than lead.
/// @pre the links have their shapes
void warn_of_odd_masses(const Tree& tree, const Outline& outline, Diagnostics& warnings);

}  // namespace tandem::model
