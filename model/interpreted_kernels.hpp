// The kernels of any tree without a compiler: the algorithms of model/ on doubles behind the C
// interface. Slow, and they allocate: for what is looked at before a run, never for the cycle.
// Layer: model.  Thread: one; one robot at a time, for the C interface has no place for `this`.
#pragma once

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
    kernels_.nq = static_cast<std::uint32_t>(mechanism_.nq());
    kernels_.nv = static_cast<std::uint32_t>(mechanism_.nv());
    kernels_.joint_names = list(mechanism_.joint_names, kernels_.joints);
    kernels_.site_names = list(mechanism_.site_names, kernels_.sites);
    kernels_.wrench_names = list(mechanism_.wrench_names, kernels_.wrenches);
    kernels_.sensor_names = list(mechanism_.sensor_names, kernels_.sensors);
    kernels_.mass_kg = mechanism_.mass_kg;
    for (std::size_t i = 0; i < 3; ++i) kernels_.gravity_m_s2[i] = mechanism_.gravity[i];
    set_functions();
    current() = &mechanism_;
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
  static const Mechanism*& current() {
    static const Mechanism* mechanism = nullptr;
    return mechanism;
  }
  static const Mechanism& m() { return *current(); }
  static std::span<const double> q(In in) { return {in, static_cast<std::size_t>(m().nq())}; }
  static std::span<const double> v(In in) { return {in, static_cast<std::size_t>(m().nv())}; }
  static std::span<const double> f(In in) {
    return {in, 6 * static_cast<std::size_t>(m().wrenches)};
  }
  static std::span<double> out(double* values, std::size_t size) { return {values, size}; }
  static std::size_t nv() { return static_cast<std::size_t>(m().nv()); }
  static std::size_t sites() { return m().sites.size(); }

  void set_functions() {
    kernels_.forward_dynamics = [](In a, In b, In c, In d, double* r) {
      Aba<double>(m(), q(a), v(b), v(c), f(d), out(r, nv())).run();
    };
    kernels_.inverse_dynamics = [](In a, In b, In c, In d, double* r) {
      Rnea<double>(m(), q(a), v(b), v(c), f(d), out(r, nv())).run();
    };
    kernels_.mass_matrix = [](In a, double* r) {
      Crba<double>(m(), q(a), out(r, nv() * nv())).run();
    };
    kernels_.bias = [](In a, In b, double* r) {
      Rnea<double>(m(), q(a), v(b), {}, {}, out(r, nv())).run();
    };
    kernels_.generalised_momentum = [](In a, In b, In c, double* p, double* r) {
      GeneralisedMomentum<double>(m(), q(a), v(b), f(c), out(p, nv()), out(r, nv())).run();
    };
    kernels_.center_of_mass = [](In a, In b, double* c, double* cdot, double* J) {
      CenterOfMass<double>(m(), q(a), v(b), out(c, 3), out(cdot, 3), out(J, 3 * nv())).run();
    };
    kernels_.site_motion = [](In a, In b, In c, double* pose, double* twist, double* acc) {
      site_motion<double>(m(), q(a), v(b), v(c), out(pose, 12 * sites()), out(twist, 6 * sites()),
                          out(acc, 6 * sites()));
    };
    kernels_.site_jacobians = [](In a, double* J) {
      site_jacobians<double>(m(), q(a), out(J, 6 * nv() * sites()));
    };
    kernels_.sensor_wrenches = [](In a, In b, In c, In d, double* r) {
      SensorWrenches<double>(m(), q(a), v(b), v(c), f(d), out(r, 6 * m().sensors.size())).run();
    };
  }

  Mechanism mechanism_;
  std::string name_;
  std::vector<const char*> lists_[4];
  std::size_t used_ = 0;
  tandem_kernels kernels_{};
};

}  // namespace tandem::model
