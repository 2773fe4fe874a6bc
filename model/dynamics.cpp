// The inputs and outputs of every kernel by name and shape, and a call of each with doubles.
#include "model/dynamics.hpp"

namespace tandem::model {

KernelShape kernel_shape(Kernel kernel, const Mechanism& m) {
  const int sites = static_cast<int>(m.sites.size());
  const int nv = m.kernel_nv();
  const KernelArray q{"q", m.kernel_nq()};
  const KernelArray v{"v", nv};
  const KernelArray vdot{"vdot", nv};
  const KernelArray tau{"tau", nv};
  const KernelArray wrench{"wrench", 6 * m.wrenches};
  switch (kernel) {
    case Kernel::kForwardDynamics: return {"forward_dynamics", {q, v, tau, wrench}, {vdot}};
    case Kernel::kInverseDynamics: return {"inverse_dynamics", {q, v, vdot, wrench}, {tau}};
    case Kernel::kMassMatrix: return {"mass_matrix", {q}, {{"M", nv * nv}}};
    case Kernel::kBias: return {"bias", {q, v}, {{"h", nv}}};
    case Kernel::kCenterOfMass:
      return {"center_of_mass", {q, v}, {{"c", 3}, {"cdot", 3}, {"J", 3 * nv}}};
    case Kernel::kCentroidalMomentum: return {"centroidal_momentum", {q, v}, {{"h", 6}}};
    case Kernel::kEnergy: return {"energy", {q, v}, {{"kinetic_potential", 2}}};
    case Kernel::kSiteMotion:
      return {"site_motion",
              {q, v, vdot},
              {{"pose", 12 * sites}, {"twist", 6 * sites}, {"acceleration", 6 * sites}}};
    case Kernel::kSiteTwists:
      return {"site_twists", {q, v}, {{"pose", 12 * sites}, {"twist", 6 * sites}}};
    case Kernel::kSiteJacobians: return {"site_jacobians", {q}, {{"J", 6 * sites * nv}}};
    case Kernel::kSensorWrenches:
      return {"sensor_wrenches",
              {q, v, vdot, wrench},
              {{"out", 6 * static_cast<int>(m.sensors.size())}}};
    case Kernel::kGeneralisedMomentum:
      return {"generalised_momentum", {q, v, wrench}, {{"p", nv}, {"b", nv}}};
    case Kernel::kInverseDynamicsDerivatives:
      return {"inverse_dynamics_derivatives",
              {q, v, vdot, wrench},
              {{"dtau_dq", nv * nv}, {"dtau_dv", nv * nv}, {"dtau_dvdot", nv * nv}}};
    case Kernel::kForwardDynamicsDerivatives:
      return {"forward_dynamics_derivatives",
              {q, v, tau, wrench},
              {{"dvdot_dq", nv * nv}, {"dvdot_dv", nv * nv}, {"dvdot_dtau", nv * nv}}};
  }
  return {};
}

std::vector<std::vector<double>> evaluate_kernel(Kernel kernel, const Mechanism& m,
                                                 const std::vector<std::vector<double>>& in) {
  std::vector<std::vector<double>> out;
  for (const KernelArray& array : kernel_shape(kernel, m).outputs)
    out.emplace_back(static_cast<std::size_t>(array.size), 0.0);
  run_kernel<double>(kernel, m, in, out);
  return out;
}

}  // namespace tandem::model
