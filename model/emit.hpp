// Kernels as expressions (trace.cpp), and expressions written as C++: straight-line functions of
// bounded size over one workspace (emit.cpp).
// Layer: model.  Thread: non-RT.
#pragma once

#include <string>
#include <vector>

#include "model/dynamics.hpp"
#include "model/expression.hpp"
#include "model/sine_table.hpp"

namespace tandem::model {

/// A kernel as expressions of its inputs.
struct TracedKernel {
  KernelShape shape;
  std::vector<Expr> outputs;  ///< the output arrays, one after another
};

/// Runs the kernel's algorithm over expressions in `graph`.
[[nodiscard]] TracedKernel trace_kernel(Kernel kernel, const Mechanism& m, Graph& graph);

/// The product M(q) vdot as expressions: inverse dynamics at rest and without gravity. Its
/// shape is that of a function "mass_times" (q, vdot -> tau).
[[nodiscard]] TracedKernel trace_mass_times(const Mechanism& m, Graph& graph);

/// A kernel as C++. `entry` calls every function of `parts` in order; they share a workspace on
/// the stack, because compilers take far more than twice as long for a function twice as long. The
/// entry of a kernel of q is two functions: "NAME_at" takes the sines and cosines of q, which
/// "NAME" computes before it calls it.
struct EmittedKernel {
  std::string name;
  std::string parameters;                 ///< "const double* q, …" of the entry
  std::string entry;                      ///< definitions
  std::vector<std::string> parts;         ///< definitions
  std::vector<std::string> declarations;  ///< of the parts
  std::vector<std::uint32_t> sizes;       ///< operations of each part
  OperationCount count;
};

/// Sums in the order in which their terms become known, what two limbs do alike as operations on
/// vectors of two.
///
/// @param m                what the kernel was traced of.
/// @param sines            the robot's, gets the kernel's angles.
/// @param part_operations  a part is closed once it holds this many additions and products.
[[nodiscard]] EmittedKernel emit_kernel(const Graph& graph, const TracedKernel& kernel,
                                        const Mechanism& m, SineTable& sines,
                                        std::uint32_t part_operations);

/// The same kernel for four states of many, as "NAME_four" (states, …), where element i of an array
/// is at [i * states], or for eight that stand alone, as "NAME_eight": each number is a vector of
/// as many.
[[nodiscard]] EmittedKernel emit_batch(const Graph& graph, const TracedKernel& kernel,
                                       std::uint32_t states, std::uint32_t part_operations);

// solve_source.cpp: the derivatives of forward dynamics. They solve with the mass matrix for all
// columns of those of inverse dynamics at once.

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
