// 07: how accelerations change near a state, as predictive control asks for it. robot.toml of the
// double pendulum needs `derivatives = true` in [model]; then
//   tandem model build robot.toml -o kernels.so
//   build/release/bin/example_07_derivatives kernels.so
#include <array>
#include <cmath>
#include <cstdio>
#include "model/kernel_library.hpp"

using Two = std::array<double, 2>;
using Matrix = std::array<double, 4>;  // row-major: row i has the derivatives of acceleration i

int main(int argc, char** argv) {
  const auto failed = [](const char* why) { return std::fprintf(stderr, "error: %s\n", why), 2; };
  if (argc != 2) return failed("name the kernels that `tandem model build` made");
  const auto kernels = tandem::model::load_kernels(argv[1]);
  if (!kernels) return failed(kernels.error().to_string().c_str());
  const tandem_kernels& robot = **kernels;
  if (robot.nv != 2) return failed("these kernels are not the double pendulum's");
  if (robot.forward_dynamics_derivatives == nullptr)
    return failed("no derivatives: robot.toml needs `derivatives = true` in [model]");
  const Two q{0.5, -0.5}, v{0.3, 0.2}, tau{0.1, 0.0};
  const double* no_wrench = nullptr;  // none of its sites takes one
  Matrix by_q, by_v, by_tau;
  robot.forward_dynamics_derivatives(q.data(), v.data(), tau.data(), no_wrench, by_q.data(),
                                     by_v.data(), by_tau.data());
  const auto accelerations = [&](const Two& at_q, const Two& at_v, const Two& at_tau) {
    Two vdot;
    robot.forward_dynamics(at_q.data(), at_v.data(), at_tau.data(), no_wrench, vdot.data());
    return vdot;
  };
  const Two here = accelerations(q, v, tau), dq{1e-4, 2e-4}, dv{-1e-4, 1e-4}, dtau{1e-4, 0.0};
  const Two there = accelerations({q[0] + dq[0], q[1] + dq[1]}, {v[0] + dv[0], v[1] + dv[1]},
                                  {tau[0] + dtau[0], tau[1] + dtau[1]});
  bool near = true;
  for (std::size_t i = 0; i < 2; ++i) {
    double change = 0.0;
    for (std::size_t j = 0; j < 2; ++j)
      change += by_q[2 * i + j] * dq[j] + by_v[2 * i + j] * dv[j] + by_tau[2 * i + j] * dtau[j];
    std::printf("joint %zu: %+.8f rad/s^2 predicted, %+.8f computed\n", i + 1, change,
                there[i] - here[i]);
    near = near && std::abs(there[i] - here[i] - change) < 1e-3 * std::abs(change);
  }
  return near ? 0 : 1;
}
