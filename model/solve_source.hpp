// The C++ of the derivatives of forward dynamics: it solves with the mass matrix for all columns of
// those of inverse dynamics at once.
// Layer: model.  Thread: non-RT.
#pragma once

#include "model/emit.hpp"

namespace tandem::model {

/// M(q) = L^T D L as expressions of M's lower triangle: a function "mass_factor" (M -> L,
/// minus_reciprocal) with L's entries below the diagonal, row by row, as far as they are not zero,
/// and -1/D.
///
/// @param inverse  the traced kernel kInverseDynamicsDerivatives, whose M has zeros
[[nodiscard]] TracedKernel trace_mass_factor(const TracedKernel& inverse, const Mechanism& m,
                                             Graph& graph);

/// The kernel forward_dynamics_derivatives. It calls the kernels forward_dynamics and
/// inverse_dynamics_derivatives, whose operations its count lacks, and `factor`, which becomes part
/// of it.
[[nodiscard]] EmittedKernel emit_forward_derivatives(const TracedKernel& inverse,
                                                     const Mechanism& m, EmittedKernel factor,
                                                     std::uint32_t part_operations);

}  // namespace tandem::model
