// The nearest inertia that a body can have.
// Layer: model, private to urdf*.cpp.  Thread: non-RT only.
#pragma once

#include <optional>
#include <string>

#include "model/tree.hpp"

namespace tandem::model {

struct InertiaRepair {
  Inertia inertia;   ///< mass and center of mass are the old ones
  std::string text;  ///< "the inertia …: principal moments …; taken: …"
};

/// What to take for an impossible inertia; empty when it is possible, or beyond repair (a negative
/// mass, a number that is not finite).
///
/// An inertia I is possible when the second moments J = tr(I)/2 1 - I of the mass about its center
/// have no negative eigenvalue (Wensing, Kim, Slotine 2017). J's eigenvalues are raised to 1e-4
/// of the largest: the nearest J, in Frobenius' norm, of a body that is nowhere thinner than a
/// hundredth of its length. A J that is as small as that of a body of 0.1 mm says nothing of the
/// shape, and neither does one of a body of more than 10 m; the link is taken for a solid ball of
/// aluminium. An inertia without mass is dropped.
[[nodiscard]] std::optional<InertiaRepair> repaired(const Inertia& inertia);

}  // namespace tandem::model
