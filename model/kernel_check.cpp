// Compares outputs at four seeded states; the tolerance is 1e-11, or 64 times the error of the same
// algorithm on doubles.
#include "model/kernel_check.hpp"

#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <random>

#include "model/kernel_library.hpp"

namespace tandem::model {
namespace {

constexpr double kTolerance = 1e-11;
constexpr double kRoundingMargin = 64.0;
constexpr unsigned kStates = 4;

using Arrays = std::vector<std::vector<double>>;

template <class S>
Arrays evaluate_as(Kernel kernel, const Mechanism& m, const Arrays& in) {
  std::vector<std::vector<S>> inputs;
  for (const auto& array : in) inputs.emplace_back(array.begin(), array.end());
  std::vector<std::vector<S>> outputs;
  for (const KernelArray& array : kernel_shape(kernel, m).outputs)
    outputs.emplace_back(static_cast<std::size_t>(array.size), S(0.0));
  run_kernel<S>(kernel, m, inputs, outputs);
  Arrays result;
  for (const auto& array : outputs) {
    result.emplace_back();
    for (const S& value : array) result.back().push_back(static_cast<double>(value));
  }
  return result;
}

// The worst of a kernel's outputs.
double worst_error(Kernel kernel, const Mechanism& m, const Arrays& actual,
                   const Arrays& expected) {
  double worst = 0.0;
  for (std::size_t i = 0; i < expected.size(); ++i)
    worst = std::max(worst, kernel_error(kernel, m.mass_kg, actual[i], expected[i]));
  return worst;
}

std::unexpected<Error> disagreement(const std::string& kernel, const char* variant, double error,
                                    double allowed) {
  return fail(
      fmt::format("the kernel {} ({}) is off by {:.2g} of its largest entry, where rounding "
                  "explains {:.2g}",
                  kernel, variant, error, allowed),
      "the library was not written; please report it with the robot's files");
}

}  // namespace

Arrays call_kernel(const tandem_kernels& k, Kernel kernel, const Mechanism& m, const Arrays& in) {
  Arrays out;
  for (const KernelArray& array : kernel_shape(kernel, m).outputs)
    out.emplace_back(static_cast<std::size_t>(array.size),
                     std::numeric_limits<double>::quiet_NaN());
  const auto i = [&](std::size_t n) { return in[n].data(); };
  const auto o = [&](std::size_t n) { return out[n].data(); };
  switch (kernel) {
    case Kernel::kForwardDynamics: k.forward_dynamics(i(0), i(1), i(2), i(3), o(0)); break;
    case Kernel::kInverseDynamics: k.inverse_dynamics(i(0), i(1), i(2), i(3), o(0)); break;
    case Kernel::kMassMatrix: k.mass_matrix(i(0), o(0)); break;
    case Kernel::kBias: k.bias(i(0), i(1), o(0)); break;
    case Kernel::kCenterOfMass: k.center_of_mass(i(0), i(1), o(0), o(1), o(2)); break;
    case Kernel::kCentroidalMomentum: k.centroidal_momentum(i(0), i(1), o(0)); break;
    case Kernel::kEnergy: k.energy(i(0), i(1), o(0)); break;
    case Kernel::kSiteMotion: k.site_motion(i(0), i(1), i(2), o(0), o(1), o(2)); break;
    case Kernel::kSiteTwists: k.site_twists(i(0), i(1), o(0), o(1)); break;
    case Kernel::kSiteJacobians: k.site_jacobians(i(0), o(0)); break;
    case Kernel::kSensorWrenches: k.sensor_wrenches(i(0), i(1), i(2), i(3), o(0)); break;
    case Kernel::kGeneralisedMomentum: k.generalised_momentum(i(0), i(1), i(2), o(0), o(1)); break;
    case Kernel::kInverseDynamicsDerivatives:
      k.inverse_dynamics_derivatives(i(0), i(1), i(2), i(3), o(0), o(1), o(2));
      break;
    case Kernel::kForwardDynamicsDerivatives:
      k.forward_dynamics_derivatives(i(0), i(1), i(2), i(3), o(0), o(1), o(2));
      break;
  }
  return out;
}

std::vector<Arrays> call_batch(const tandem_kernels& k, Kernel kernel, const Mechanism& m,
                               const std::vector<Arrays>& in) {
  const std::size_t states = in.size();
  Arrays arrays;  // element i of state s at [i * states + s]
  for (std::size_t a = 0; a < in[0].size(); ++a) {
    arrays.emplace_back();
    for (std::size_t i = 0; i < in[0][a].size(); ++i)
      for (const Arrays& state : in) arrays.back().push_back(state[a][i]);
  }
  const auto size = static_cast<std::size_t>(kernel_shape(kernel, m).outputs[0].size);
  std::vector<double> out(size * states, std::numeric_limits<double>::quiet_NaN());
  const auto function =
      kernel == Kernel::kForwardDynamics ? k.forward_dynamics_batch : k.inverse_dynamics_batch;
  function(static_cast<std::uint32_t>(states), arrays[0].data(), arrays[1].data(), arrays[2].data(),
           arrays[3].data(), out.data());
  std::vector<Arrays> result(states, Arrays(1));
  for (std::size_t i = 0; i < size; ++i)
    for (std::size_t s = 0; s < states; ++s) result[s][0].push_back(out[i * states + s]);
  return result;
}

SeededState::SeededState(const Mechanism& m, unsigned seed) {
  std::mt19937 generator(seed);
  const auto array = [&](int size, double range) {
    std::vector<double> values;
    for (int i = 0; i < size; ++i)
      values.push_back(range * (static_cast<double>(generator()) / 2147483648.0 - 1.0));
    return values;
  };
  q = array(m.kernel_nq(), 3.0);
  v = array(m.kernel_nv(), 2.0);
  vdot = array(m.kernel_nv(), 5.0);
  tau = array(m.kernel_nv(), 10.0);
  wrench = array(6 * m.wrenches, 20.0);
  if (!m.floating_base) return;
  const double norm = std::hypot(std::hypot(q[3], q[4]), std::hypot(q[5], q[6]));
  for (std::size_t k = 3; k < 7; ++k) q[k] /= norm;
}

Arrays SeededState::of(Kernel kernel) const {
  switch (kernel) {
    case Kernel::kForwardDynamics:
    case Kernel::kForwardDynamicsDerivatives: return {q, v, tau, wrench};
    case Kernel::kInverseDynamics:
    case Kernel::kInverseDynamicsDerivatives:
    case Kernel::kSensorWrenches: return {q, v, vdot, wrench};
    case Kernel::kMassMatrix:
    case Kernel::kSiteJacobians: return {q};
    case Kernel::kGeneralisedMomentum: return {q, v, wrench};
    case Kernel::kSiteMotion: return {q, v, vdot};
    case Kernel::kBias:
    case Kernel::kCenterOfMass:
    case Kernel::kCentroidalMomentum:
    case Kernel::kSiteTwists:
    case Kernel::kEnergy: return {q, v};
  }
  return {};
}

double kernel_error(Kernel kernel, double mass_kg, const std::vector<double>& actual,
                    const std::vector<double>& expected) {
  if (actual.size() != expected.size()) return std::numeric_limits<double>::infinity();
  double scale = 0.01;
  switch (kernel) {
    case Kernel::kInverseDynamics:
    case Kernel::kBias:
    case Kernel::kEnergy:
    case Kernel::kSensorWrenches:
    case Kernel::kGeneralisedMomentum:
    case Kernel::kInverseDynamicsDerivatives: scale = 0.1 * mass_kg; break;
    case Kernel::kMassMatrix:
    case Kernel::kCentroidalMomentum: scale = 0.01 * mass_kg; break;
    default: break;
  }
  double difference = 0.0;
  for (std::size_t i = 0; i < expected.size(); ++i) {
    if (!std::isfinite(actual[i])) return std::numeric_limits<double>::infinity();
    difference = std::max(difference, std::abs(actual[i] - expected[i]));
    scale = std::max(scale, std::abs(expected[i]));
  }
  return difference / scale;
}

namespace {

// What one kernel computes at each seeded state, and how far from it rounding may lead.
struct Expected {
  std::vector<Arrays> inputs, outputs;
  double allowed = kTolerance;

  Expected(Kernel kernel, const Mechanism& m) {
    for (unsigned seed = 1; seed <= kStates; ++seed) {
      inputs.push_back(SeededState(m, seed).of(kernel));
      outputs.push_back(evaluate_as<long double>(kernel, m, inputs.back()));
      const Arrays on_doubles = evaluate_as<double>(kernel, m, inputs.back());
      const double error = worst_error(kernel, m, on_doubles, outputs.back());
      allowed = std::max(allowed, kRoundingMargin * error);
    }
  }
};

}  // namespace

Status check_kernels(const std::string& library, const Tree& tree, const ModelSpec& spec) {
  const Result<Mechanism> m = make_mechanism(tree, spec, Frames::kAsDescribed);
  if (!m) return std::unexpected(m.error());
  if (const auto best = load_kernels(library); !best) return std::unexpected(best.error());
  for (int k = 0; k < (spec.derivatives ? kAllKernels : kKernels); ++k) {
    const Kernel kernel = static_cast<Kernel>(k);
    const Expected expected(kernel, *m);
    for (const char* variant : kVariantNames) {
      const auto loaded = load_kernels(library, {}, variant);
      if (!loaded) continue;  // another CPU's
      for (unsigned state = 0; state < kStates; ++state) {
        const Arrays actual = call_kernel(**loaded, kernel, *m, expected.inputs[state]);
        const double error = worst_error(kernel, *m, actual, expected.outputs[state]);
        if (!(error <= expected.allowed))
          return disagreement(kernel_shape(kernel, *m).name, variant, error, expected.allowed);
      }
      if (kernel != Kernel::kForwardDynamics && kernel != Kernel::kInverseDynamics) continue;
      std::vector<Arrays> many;  // eight at once, and four
      for (unsigned state = 0; state < 12; ++state)
        many.push_back(expected.inputs[state % kStates]);
      const auto batch = call_batch(**loaded, kernel, *m, many);
      for (unsigned state = 0; state < many.size(); ++state) {
        const double error =
            worst_error(kernel, *m, batch[state], expected.outputs[state % kStates]);
        if (!(error <= expected.allowed))
          return disagreement(kernel_shape(kernel, *m).name + "_batch", variant, error,
                              expected.allowed);
      }
    }
  }
  return {};
}

}  // namespace tandem::model
