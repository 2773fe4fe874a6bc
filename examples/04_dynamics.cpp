// 04: a robot's generated dynamics by themselves: a pendulum without motors keeps its energy. Only
// model/kernels.h of Tandem is needed, nothing to link:
//   g++ -I. examples/04_dynamics.cpp -o pendulum
//   ./pendulum build/release/lib/models/double_pendulum_kernels.so
#include <dlfcn.h>

#include <array>
#include <cmath>
#include <cstdio>

#include "model/kernels.h"

using State = std::array<double, 4>;  // q then v

int main(int argc, char** argv) {
  const auto failed = [](const char* why) { return std::fprintf(stderr, "error: %s\n", why), 2; };
  if (argc != 2) return failed("name the kernels of the double pendulum: .../NAME_kernels.so");
  void* library = dlopen(argv[1], RTLD_NOW | RTLD_LOCAL);
  if (library == nullptr) return failed(dlerror());
  const auto get =
      reinterpret_cast<decltype(&tandem_kernels_get)>(dlsym(library, "tandem_kernels_get"));
  const tandem_kernels* kernels = get == nullptr ? nullptr : get(nullptr);  // this CPU's best
  if (kernels == nullptr || kernels->abi != TANDEM_KERNELS_ABI)
    return failed("not the kernels of this version: build them again");
  if (kernels->nv != 2) return failed("these kernels are not the double pendulum's");
  const tandem_kernels& robot = *kernels;
  std::printf("%s, %.3f kg, kernels for %s\n", robot.robot, robot.mass_kg, robot.variant);
  const double none[2] = {};  // no torque on any joint, no wrench
  const auto rate = [&](const State& x) {
    State out{x[2], x[3]};
    robot.forward_dynamics(x.data(), x.data() + 2, none, none, out.data() + 2);
    return out;
  };
  const auto along = [](State x, const State& d, double h) {
    for (std::size_t i = 0; i < x.size(); ++i) x[i] += h * d[i];
    return x;
  };
  const double h = 1e-3;
  State x{0.5, -0.5, 0.0, 0.0};
  double first_J = 0.0, now_J = 0.0;
  for (int step = 0; step <= 5000; ++step) {
    double energy[2];  // kinetic, potential
    robot.energy(x.data(), x.data() + 2, energy);
    now_J = energy[0] + energy[1];
    if (step == 0) first_J = now_J;
    if (step % 1000 == 0) std::printf("%d s  %.9f J\n", step / 1000, now_J);
    const State a = rate(x), b = rate(along(x, a, h / 2)), c = rate(along(x, b, h / 2));
    const State d = rate(along(x, c, h));
    for (std::size_t i = 0; i < x.size(); ++i) x[i] += h / 6 * (a[i] + 2 * (b[i] + c[i]) + d[i]);
  }
  return std::abs(now_J - first_J) < 1e-8 ? 0 : 1;
}
