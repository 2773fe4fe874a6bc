// Whether masses and inertias of a tree are physically possible.
// Layer: model, private to urdf*.cpp.  Thread: non-RT only.
#pragma once

#include "base/result.hpp"
#include "model/tree.hpp"
#include "model/urdf_outline.hpp"

namespace tandem::model {

/// Checks every link (those of negligible mass give warnings), every body and that each moving
/// joint carries mass. Errors and warnings name the link or joint with its line.
void check_inertias(const Tree& tree, const Outline& outline, Diagnostics& errors,
                    Diagnostics& warnings);

}  // namespace tandem::model
