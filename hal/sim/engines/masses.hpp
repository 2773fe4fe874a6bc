// What engines want of the bodies that they move.
// Layer: hal/sim/engines.  Thread: any.
#pragma once

#include <Eigen/Eigenvalues>
#include <string>

#include "base/result.hpp"
#include "model/tree.hpp"

namespace tandem::sim {

/// Errors: a body that moves, named, without mass, or where `inertia` is wanted too, without one
/// about each of its axes: less than `least` [kg, kg m2].
inline Status check_masses(const model::Tree& tree, const std::string& engine, bool inertia,
                           double least = 0.0) {
  for (std::size_t b = tree.floating_base ? 0 : 1; b < tree.bodies.size(); ++b) {
    const model::Inertia& own = tree.bodies[b].inertia;
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> principal(own.about_com_kg_m2,
                                                                   Eigen::EigenvaluesOnly);
    const bool massive = own.mass_kg > least;
    if (massive && (!inertia || principal.eigenvalues().minCoeff() > least)) continue;
    return fail("link '" + tree.bodies[b].name + "' has no " + (massive ? "inertia" : "mass"),
                engine + " wants " + (inertia ? "mass and inertia" : "a mass") +
                    " in every body that moves: give it some in [model.link.NAME], or set engine "
                    "= \"tandem\"");
  }
  return {};
}

}  // namespace tandem::sim
