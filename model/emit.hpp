// Expressions written as C++: straight-line functions of bounded size over one workspace.
// Layer: model.  Thread: non-RT.
#pragma once

#include <string>
#include <vector>

#include "model/sine_table.hpp"
#include "model/trace.hpp"

namespace tandem::model {

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

/// The same kernel for four or eight states at once, as "NAME_four" or "NAME_eight": each number is
/// a vector of as many.
[[nodiscard]] EmittedKernel emit_batch(const Graph& graph, const TracedKernel& kernel,
                                       std::uint32_t states, std::uint32_t part_operations);

}  // namespace tandem::model
