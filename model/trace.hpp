// Kernels as expressions: the algorithms run over a graph.
// Layer: model.  Thread: non-RT.
#pragma once

#include <vector>

#include "model/dynamics.hpp"
#include "model/expression.hpp"

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

}  // namespace tandem::model
