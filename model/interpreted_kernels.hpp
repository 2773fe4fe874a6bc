// The kernels of any tree without a compiler: the algorithms of model/ on doubles behind the C
// interface. Slow, and they allocate: for what is looked at before a run, never for the cycle.
// Layer: model.  Thread: one; one robot at a time, for the C interface has no place for `this`.
#pragma once

#include <algorithm>
#include <initializer_list>
#include <string>
#include <utility>
#include <vector>

#include "model/dynamics.hpp"
#include "model/kernels.h"

namespace tandem::model {

class InterpretedKernels {
 public:
  /// @param mechanism  make_mechanism()'s
  explicit InterpretedKernels(Mechanism mechanism, std::string robot = {})
      : mechanism_(std::move(mechanism)), name_(std::move(robot)) {
    kernels_.abi = TANDEM_KERNELS_ABI;
    kernels_.floating_base = mechanism_.floating_base ? 1 : 0;
    kernels_.robot = name_.c_str();
    kernels_.variant = kernels_.description_hash = "";
    kernels_.nq = static_cast<std::uint32_t>(mechanism_.kernel_nq());
    kernels_.nv = static_cast<std::uint32_t>(mechanism_.kernel_nv());
    kernels_.joint_names = list(mechanism_.joint_names, kernels_.joints);
    kernels_.site_names = list(mechanism_.site_names, kernels_.sites);
    kernels_.wrench_names = list(mechanism_.wrench_names, kernels_.wrenches);
    kernels_.sensor_names = list(mechanism_.sensor_names, kernels_.sensors);
    kernels_.mass_kg = mechanism_.mass_kg;
    for (std::size_t i = 0; i < 3; ++i) kernels_.gravity_m_s2[i] = mechanism_.gravity[i];
    set_functions();
    current() = this;
  }
  ~InterpretedKernels() { current() = nullptr; }
  InterpretedKernels(const InterpretedKernels&) = delete;
  InterpretedKernels& operator=(const InterpretedKernels&) = delete;

  [[nodiscard]] const tandem_kernels* get() const { return &kernels_; }

 private:
  using In = const double*;
  const char* const* list(const std::vector<std::string>& names, std::uint32_t& count) {
    auto& pointers = lists_[used_++];
    for (const std::string& name : names) pointers.push_back(name.c_str());
    count = static_cast<std::uint32_t>(names.size());
    return pointers.data();
  }
  static const InterpretedKernels*& current() {
    static const InterpretedKernels* kernels = nullptr;
    return kernels;
  }
  static const Mechanism& m() { return current()->mechanism_; }
  static const tandem_kernels& table() { return current()->kernels_; }
  static std::span<const double> q(In in) { return {in, static_cast<std::size_t>(m().nq())}; }
  static std::span<const double> v(In in) { return {in, static_cast<std::size_t>(m().nv())}; }
  static std::span<const double> f(In in) {
    return {in, 6 * static_cast<std::size_t>(m().wrenches)};
  }
  static std::span<double> out(double* values, std::size_t size) { return {values, size}; }
  static std::size_t nv() { return static_cast<std::size_t>(m().nv()); }
  static std::size_t sites() { return m().sites.size(); }

  // Followers have no coordinate, so that the tree's algorithms are not the kernels then.
  static bool follow() { return m().has_followers(); }
  static void run(Kernel kernel, std::initializer_list<In> in, std::initializer_list<double*> to) {
    const KernelShape shape = kernel_shape(kernel, m());
    std::vector<std::vector<double>> inputs, outputs;
    for (std::size_t k = 0; k < in.size(); ++k)
      inputs.emplace_back(in.begin()[k], in.begin()[k] + shape.inputs[k].size);
    for (const KernelArray& array : shape.outputs)
      outputs.emplace_back(static_cast<std::size_t>(array.size), 0.0);
    run_kernel<double>(kernel, m(), inputs, outputs);
    for (std::size_t k = 0; k < to.size(); ++k) std::ranges::copy(outputs[k], to.begin()[k]);
  }

  void set_functions() {
    kernels_.forward_dynamics = [](In a, In b, In c, In d, double* r) {
      if (follow()) return run(Kernel::kForwardDynamics, {a, b, c, d}, {r});
      Aba<double>(m(), q(a), v(b), v(c), f(d), out(r, nv())).run();
    };
    kernels_.inverse_dynamics = [](In a, In b, In c, In d, double* r) {
      if (follow()) return run(Kernel::kInverseDynamics, {a, b, c, d}, {r});
      Rnea<double>(m(), q(a), v(b), v(c), f(d), out(r, nv())).run();
    };
    kernels_.mass_matrix = [](In a, double* r) {
      if (follow()) return run(Kernel::kMassMatrix, {a}, {r});
      Crba<double>(m(), q(a), out(r, nv() * nv())).run();
    };
    kernels_.bias = [](In a, In b, double* r) {
      if (follow()) return run(Kernel::kBias, {a, b}, {r});
      Rnea<double>(m(), q(a), v(b), {}, {}, out(r, nv())).run();
    };
    kernels_.generalised_momentum = [](In a, In b, In c, double* p, double* r) {
      if (follow()) return run(Kernel::kGeneralisedMomentum, {a, b, c}, {p, r});
      GeneralisedMomentum<double>(m(), q(a), v(b), f(c), out(p, nv()), out(r, nv())).run();
    };
    kernels_.center_of_mass = [](In a, In b, double* c, double* cdot, double* J) {
      if (follow()) return run(Kernel::kCenterOfMass, {a, b}, {c, cdot, J});
      CenterOfMass<double>(m(), q(a), v(b), out(c, 3), out(cdot, 3), out(J, 3 * nv())).run();
    };
    kernels_.site_motion = [](In a, In b, In c, double* pose, double* twist, double* acc) {
      if (follow()) return run(Kernel::kSiteMotion, {a, b, c}, {pose, twist, acc});
      site_motion<double>(m(), q(a), v(b), v(c), out(pose, 12 * sites()), out(twist, 6 * sites()),
                          out(acc, 6 * sites()));
    };
    kernels_.site_twists = [](In a, In b, double* pose, double* twist) {
      if (follow()) return run(Kernel::kSiteTwists, {a, b}, {pose, twist});
      site_twists<double>(m(), q(a), v(b), out(pose, 12 * sites()), out(twist, 6 * sites()));
    };
    kernels_.site_jacobians = [](In a, double* J) {
      if (follow()) return run(Kernel::kSiteJacobians, {a}, {J});
      site_jacobians<double>(m(), q(a), out(J, 6 * nv() * sites()));
    };
    kernels_.sensor_wrenches = [](In a, In b, In c, In d, double* r) {
      if (follow()) return run(Kernel::kSensorWrenches, {a, b, c, d}, {r});
      SensorWrenches<double>(m(), q(a), v(b), v(c), f(d), out(r, 6 * m().sensors.size())).run();
    };
    set_forms_at_sines();
  }

  // Each computes its own.
  void set_forms_at_sines() {
    kernels_.sine_count = 1;
    kernels_.sines = [](In, double*) {};
    kernels_.forward_dynamics_at = [](In, In a, In b, In c, In d, double* r) {
      table().forward_dynamics(a, b, c, d, r);
    };
    kernels_.inverse_dynamics_at = [](In, In a, In b, In c, In d, double* r) {
      table().inverse_dynamics(a, b, c, d, r);
    };
    kernels_.mass_matrix_at = [](In, In a, double* r) { table().mass_matrix(a, r); };
    kernels_.bias_at = [](In, In a, In b, double* r) { table().bias(a, b, r); };
    kernels_.generalised_momentum_at = [](In, In a, In b, In c, double* p, double* r) {
      table().generalised_momentum(a, b, c, p, r);
    };
    kernels_.center_of_mass_at = [](In, In a, In b, double* c, double* cdot, double* J) {
      table().center_of_mass(a, b, c, cdot, J);
    };
    kernels_.site_motion_at = [](In, In a, In b, In c, double* pose, double* twist, double* acc) {
      table().site_motion(a, b, c, pose, twist, acc);
    };
    kernels_.site_twists_at = [](In, In a, In b, double* pose, double* twist) {
      table().site_twists(a, b, pose, twist);
    };
    kernels_.site_jacobians_at = [](In, In a, double* J) { table().site_jacobians(a, J); };
    kernels_.sensor_wrenches_at = [](In, In a, In b, In c, In d, double* r) {
      table().sensor_wrenches(a, b, c, d, r);
    };
  }

  Mechanism mechanism_;
  std::string name_;
  std::vector<const char*> lists_[4];
  std::size_t used_ = 0;
  tandem_kernels kernels_{};
};

}  // namespace tandem::model
