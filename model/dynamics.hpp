// The algorithms behind every kernel, written once over the scalar: double to check, Expr to
// generate. Functions of a mechanism with the arrays of model/kernels.h.
// Layer: model.  Thread: any.
#pragma once

#include "model/forward_dynamics.hpp"
#include "model/inverse_dynamics.hpp"
#include "model/momentum.hpp"
#include "model/sites.hpp"

namespace tandem::model {

/// The kernels of model/kernels.h in that order.
enum class Kernel : std::uint8_t {
  kForwardDynamics,
  kInverseDynamics,
  kMassMatrix,
  kBias,
  kCenterOfMass,
  kCentroidalMomentum,
  kEnergy,
  kSiteMotion,
  kSiteJacobians,
  kSensorWrenches,
};
inline constexpr int kKernels = 10;

/// One array argument of a kernel.
struct KernelArray {
  std::string name;
  int size = 0;
};

/// A kernel's name and arguments, inputs first, as in model/kernels.h.
struct KernelShape {
  std::string name;
  std::vector<KernelArray> inputs;
  std::vector<KernelArray> outputs;
};
[[nodiscard]] KernelShape kernel_shape(Kernel kernel, const Mechanism& m);

/// Runs one kernel. `in` and `out` hold an array for each argument of its shape.
template <class S>
void run_kernel(Kernel kernel, const Mechanism& m, const std::vector<std::vector<S>>& in,
                std::vector<std::vector<S>>& out) {
  const auto i = [&](std::size_t k) { return std::span<const S>(in[k]); };
  const auto o = [&](std::size_t k) { return std::span<S>(out[k]); };
  switch (kernel) {
    case Kernel::kForwardDynamics: return ForwardDynamics<S>(m, i(0), i(1), i(2), i(3), o(0)).run();
    case Kernel::kInverseDynamics: return InverseDynamics<S>(m, i(0), i(1), i(2), i(3), o(0)).run();
    case Kernel::kMassMatrix: return MassMatrix<S>(m, i(0), o(0)).run();
    case Kernel::kBias: return InverseDynamics<S>(m, i(0), i(1), {}, {}, o(0)).run();
    case Kernel::kCenterOfMass: return CenterOfMass<S>(m, i(0), i(1), o(0), o(1), o(2)).run();
    case Kernel::kCentroidalMomentum: return centroidal_momentum<S>(m, i(0), i(1), o(0));
    case Kernel::kEnergy: return energy<S>(m, i(0), i(1), o(0));
    case Kernel::kSiteMotion: return site_motion<S>(m, i(0), i(1), i(2), o(0), o(1), o(2));
    case Kernel::kSiteJacobians: return site_jacobians<S>(m, i(0), o(0));
    case Kernel::kSensorWrenches: return SensorWrenches<S>(m, i(0), i(1), i(2), i(3), o(0)).run();
  }
}

/// Runs one kernel on doubles: the check on generated code.
[[nodiscard]] std::vector<std::vector<double>> evaluate_kernel(
    Kernel kernel, const Mechanism& m, const std::vector<std::vector<double>>& in);

}  // namespace tandem::model
