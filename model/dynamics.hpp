// The algorithms behind every kernel, written once over the scalar: double to check, Expr to
// generate. Functions of a mechanism with the arrays of model/kernels.h.
// Layer: model.  Thread: any.
#pragma once

#include "model/coordinates.hpp"
#include "model/derivatives.hpp"
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
  kSiteTwists,
  kSiteJacobians,
  kSensorWrenches,
  kGeneralisedMomentum,
  kInverseDynamicsDerivatives,
  kForwardDynamicsDerivatives,
};
inline constexpr int kKernels = 12;     ///< in every library
inline constexpr int kAllKernels = 14;  ///< where ModelSpec::derivatives asks for them

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

/// Runs one kernel as if every joint had a coordinate of its own. Derivatives of forward dynamics
/// are run_kernel()'s.
template <class S>
void run_tree_kernel(Kernel kernel, const Mechanism& m, const std::vector<std::vector<S>>& in,
                     std::vector<std::vector<S>>& out) {
  const auto i = [&](std::size_t k) { return std::span<const S>(in[k]); };
  const auto o = [&](std::size_t k) { return std::span<S>(out[k]); };
  switch (kernel) {
    case Kernel::kForwardDynamics: return Aba<S>(m, i(0), i(1), i(2), i(3), o(0)).run();
    case Kernel::kInverseDynamics: return Rnea<S>(m, i(0), i(1), i(2), i(3), o(0)).run();
    case Kernel::kMassMatrix: return Crba<S>(m, i(0), o(0)).run();
    case Kernel::kBias: return Rnea<S>(m, i(0), i(1), {}, {}, o(0)).run();
    case Kernel::kCenterOfMass: return CenterOfMass<S>(m, i(0), i(1), o(0), o(1), o(2)).run();
    case Kernel::kCentroidalMomentum: return centroidal_momentum<S>(m, i(0), i(1), o(0));
    case Kernel::kEnergy: return energy<S>(m, i(0), i(1), o(0));
    case Kernel::kSiteMotion: return site_motion<S>(m, i(0), i(1), i(2), o(0), o(1), o(2));
    case Kernel::kSiteTwists: return site_twists<S>(m, i(0), i(1), o(0), o(1));
    case Kernel::kSiteJacobians: return site_jacobians<S>(m, i(0), o(0));
    case Kernel::kSensorWrenches: return SensorWrenches<S>(m, i(0), i(1), i(2), i(3), o(0)).run();
    case Kernel::kGeneralisedMomentum:
      return GeneralisedMomentum<S>(m, i(0), i(1), i(2), o(0), o(1)).run();
    case Kernel::kInverseDynamicsDerivatives:
      return RneaDerivatives<S>(m, i(0), i(1), i(2), i(3), o(0), o(1), o(2)).run();
    case Kernel::kForwardDynamicsDerivatives: return;
  }
}

/// The kernels of a mechanism with followers. With q_tree = G q + g, G constant, each is the
/// tree's own with its columns gathered: M = G^T M_tree G, h = G^T h_tree, J = J_tree G. Forward
/// dynamics solves with M, for a force passes between a follower and its leader that the
/// articulated-body algorithm, which goes along the tree, cannot carry.
template <class S>
class FollowerKernels {
 public:
  using Arrays = std::vector<std::vector<S>>;
  explicit FollowerKernels(const Mechanism& m) : m_(m) {}

  void run(Kernel kernel, const Arrays& in, Arrays& out) const {
    switch (kernel) {
      case Kernel::kForwardDynamics: return forward_dynamics(in, out[0]);
      case Kernel::kMassMatrix: return mass_matrix(in, out[0]);
      case Kernel::kInverseDynamics:
      case Kernel::kBias:
      case Kernel::kGeneralisedMomentum:
        out = on_tree(kernel, in);
        for (std::vector<S>& forces : out) forces = gather_forces<S>(m_, forces);
        return;
      case Kernel::kSiteJacobians: out[0] = gather_columns<S>(m_, on_tree(kernel, in)[0]); return;
      case Kernel::kCenterOfMass:
        out = on_tree(kernel, in);
        out[2] = gather_columns<S>(m_, out[2]);
        return;
      case Kernel::kCentroidalMomentum:
      case Kernel::kEnergy:
      case Kernel::kSiteMotion:
      case Kernel::kSiteTwists:
      case Kernel::kSensorWrenches: out = on_tree(kernel, in); return;
      case Kernel::kInverseDynamicsDerivatives:
        out = on_tree(kernel, in);
        for (std::vector<S>& matrix : out) matrix = gather_both(matrix);
        return;
      case Kernel::kForwardDynamicsDerivatives: return;
    }
  }

 private:
  // The tree's kernel at the positions and rates that the coordinates `in` give every joint.
  Arrays on_tree(Kernel kernel, const Arrays& in) const {
    const KernelShape shape = kernel_shape(kernel, m_);
    Arrays spread = in;
    for (std::size_t a = 0; a < in.size(); ++a) {
      const std::string& name = shape.inputs[a].name;
      if (name == "q") spread[a] = spread_positions<S>(m_, in[a]);
      if (name == "v" || name == "vdot") spread[a] = spread_rates<S>(m_, in[a]);
    }
    Arrays out;
    for (const int size : tree_sizes(kernel, shape)) out.emplace_back(size, S(0.0));
    run_tree_kernel<S>(kernel, m_, spread, out);
    return out;
  }

  // How long the tree's outputs are, which have an entry or a column for every joint.
  std::vector<int> tree_sizes(Kernel kernel, const KernelShape& shape) const {
    std::vector<int> sizes;
    for (const KernelArray& array : shape.outputs) sizes.push_back(array.size);
    const int nv = m_.nv();
    if (kernel == Kernel::kMassMatrix) sizes[0] = nv * nv;
    if (kernel == Kernel::kInverseDynamicsDerivatives) sizes.assign(3, nv * nv);
    if (kernel == Kernel::kInverseDynamics || kernel == Kernel::kBias) sizes[0] = nv;
    if (kernel == Kernel::kGeneralisedMomentum) sizes.assign(2, nv);
    if (kernel == Kernel::kSiteJacobians) sizes[0] = 6 * static_cast<int>(m_.sites.size()) * nv;
    if (kernel == Kernel::kCenterOfMass) sizes[2] = 3 * nv;
    return sizes;
  }

  // G^T A G
  std::vector<S> gather_both(const std::vector<S>& A) const {
    return gather_rows<S>(m_, gather_columns<S>(m_, A));
  }

  void mass_matrix(const Arrays& in, std::vector<S>& M) const {
    M = gather_both(on_tree(Kernel::kMassMatrix, in)[0]);
  }

  void forward_dynamics(const Arrays& in, std::vector<S>& vdot) const {
    std::vector<S> M;
    mass_matrix({in[0]}, M);
    const std::vector<S> none(in[1].size(), S(0.0));
    const std::vector<S> bias =
        gather_forces<S>(m_, on_tree(Kernel::kInverseDynamics, {in[0], in[1], none, in[3]})[0]);
    for (std::size_t i = 0; i < vdot.size(); ++i) vdot[i] = in[2][i] - bias[i];
    solve_from_leaves<S>(M, vdot);
  }

  const Mechanism& m_;
};

template <class S>
void run_kernel(Kernel kernel, const Mechanism& m, const std::vector<std::vector<S>>& in,
                std::vector<std::vector<S>>& out);

/// d vdot / d q and d v by the implicit function tau(q, v, vdot(q, v, tau)) = tau: -M^-1 times the
/// derivatives of inverse dynamics at this vdot; d vdot / d tau is M^-1.
template <class S>
void forward_dynamics_derivatives(const Mechanism& m, const std::vector<std::vector<S>>& in,
                                  std::vector<std::vector<S>>& out) {
  const auto nv = static_cast<std::size_t>(m.kernel_nv());
  std::vector<std::vector<S>> vdot(1, std::vector<S>(nv, S(0.0)));
  run_kernel<S>(Kernel::kForwardDynamics, m, in, vdot);
  run_kernel<S>(Kernel::kInverseDynamicsDerivatives, m, {in[0], in[1], vdot[0], in[3]}, out);
  const std::vector<S> M = out[2];
  for (S& entry : out[2]) entry = S(0.0);
  for (std::size_t i = 0; i < nv; ++i) out[2][i * nv + i] = S(-1.0);
  for (std::vector<S>& matrix : out) {
    std::vector<S> factor = M;
    solve_from_leaves<S>(factor, matrix, m.kernel_nv());
    for (S& entry : matrix) entry = -entry;
  }
}

/// Runs one kernel. `in` and `out` hold an array for each argument of its shape.
template <class S>
void run_kernel(Kernel kernel, const Mechanism& m, const std::vector<std::vector<S>>& in,
                std::vector<std::vector<S>>& out) {
  if (kernel == Kernel::kForwardDynamicsDerivatives)
    return forward_dynamics_derivatives<S>(m, in, out);
  if (!m.has_followers()) return run_tree_kernel<S>(kernel, m, in, out);
  FollowerKernels<S>(m).run(kernel, in, out);
}

/// Runs one kernel on doubles: the check on generated code.
[[nodiscard]] std::vector<std::vector<double>> evaluate_kernel(
    Kernel kernel, const Mechanism& m, const std::vector<std::vector<double>>& in);

}  // namespace tandem::model
