// Whether a compiled library computes what the robot's description says: every kernel and variant
// against the algorithms in long double, on a mechanism without chosen frames and regrouping.
// Layer: model.  Thread: non-RT.
#pragma once

#include <string>
#include <vector>

#include "base/result.hpp"
#include "model/dynamics.hpp"
#include "model/kernels.h"
#include "model/model_spec.hpp"
#include "model/tree.hpp"

namespace tandem::model {

/// Runs one compiled kernel. `in` holds an array for each input of its shape.
[[nodiscard]] std::vector<std::vector<double>> call_kernel(
    const tandem_kernels& kernels, Kernel kernel, const Mechanism& m,
    const std::vector<std::vector<double>>& in);

/// Runs a kernel that has a batch (forward and inverse dynamics) at several states in one call.
/// `in` holds the inputs of each state. @pre a multiple of four states
[[nodiscard]] std::vector<std::vector<std::vector<double>>> call_batch(
    const tandem_kernels& kernels, Kernel kernel, const Mechanism& m,
    const std::vector<std::vector<std::vector<double>>>& in);

/// Inputs of every kernel at one state: joints in ±3 rad or m, a base anywhere. The same on every
/// machine.
struct SeededState {
  std::vector<double> q, v, vdot, tau, wrench;

  SeededState(const Mechanism& m, unsigned seed);
  /// The inputs of one kernel, in the order of its shape.
  [[nodiscard]] std::vector<std::vector<double>> of(Kernel kernel) const;
};

/// The largest difference, over the largest expected entry. Where all entries nearly cancel, as the
/// gravity torque of a vertical joint does, it is over 1 % of the weight on a lever of 1 m instead.
/// Infinite when sizes differ or an entry is not finite.
[[nodiscard]] double kernel_error(Kernel kernel, double mass_kg, const std::vector<double>& actual,
                                  const std::vector<double>& expected);

/// Compares every variant of a library that this CPU runs, on seeded states; batches too.
///
/// Allowed is 1e-11, or 64 times what the same algorithm on doubles is off by, where the condition
/// of the mass matrix asks for more.
/// Errors: which kernel of which variant disagrees, and by how much; a library that cannot be
/// loaded; those of make_mechanism().
[[nodiscard]] Status check_kernels(const std::string& library, const Tree& tree,
                                   const ModelSpec& spec);

}  // namespace tandem::model
