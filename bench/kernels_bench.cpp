// Time of every kernel of every bundled robot, per variant. Times mean something on an idle
// machine only; the header that Google Benchmark prints says which one it was.
#include "bench/kernels_bench.hpp"

#include <benchmark/benchmark.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <functional>
#include <memory>
#include <random>

#include "model/kernel_library.hpp"

namespace tandem::bench {

States random_states(std::size_t nq, std::size_t nv, bool floating_base) {
  std::mt19937 generator(1);
  const auto array = [&](std::size_t size) {
    std::vector<double> values(size);
    for (double& value : values)
      value = -1.0 + 2.0 * static_cast<double>(generator()) / 4294967296.0;
    return values;
  };
  States states;
  for (std::size_t i = 0; i < States::kCount; ++i) {
    states.q.push_back(array(nq));
    states.v.push_back(array(nv));
    states.tau.push_back(array(nv));
    if (!floating_base) continue;
    std::vector<double>& q = states.q.back();
    const double norm = std::hypot(std::hypot(q[3], q[4]), std::hypot(q[5], q[6]));
    for (std::size_t k = 3; k < 7; ++k) q[k] /= norm;
  }
  return states;
}

namespace {

using Call = std::function<void(const double* q, const double* v, const double* tau)>;

// Room for any kernel's results.
struct Buffers {
  explicit Buffers(const tandem_kernels& k)
      : wrench(6 * k.wrenches + 1), a(6 * k.nv * k.sites + k.nv * k.nv + 16), b(a), c(a) {}
  std::vector<double> wrench, a, b, c;
};

void add(const std::string& name, const model::KernelLibrary& library, const Call& call) {
  const States states = random_states(library->nq, library->nv, library->floating_base != 0);
  benchmark::RegisterBenchmark(name.c_str(), [library, call, states](benchmark::State& state) {
    std::size_t i = 0;
    for (auto _ : state) {
      call(states.q[i].data(), states.v[i].data(), states.tau[i].data());
      i = (i + 1) % States::kCount;
      benchmark::ClobberMemory();
    }
  });
}

void add_kernels(const std::string& robot, const model::KernelLibrary& library) {
  const tandem_kernels& k = *library;
  const auto buffers = std::make_shared<Buffers>(k);
  Buffers& o = *buffers;
  const std::string end = "/" + robot + "/" + k.variant;
  const std::pair<const char*, Call> rows[] = {
      {"forward_dynamics",
       [&k, buffers, &o](auto q, auto v, auto tau) {
         k.forward_dynamics(q, v, tau, o.wrench.data(), o.a.data());
       }},
      {"inverse_dynamics",
       [&k, buffers, &o](auto q, auto v, auto tau) {
         k.inverse_dynamics(q, v, tau, o.wrench.data(), o.a.data());
       }},
      {"mass_matrix", [&k, buffers, &o](auto q, auto, auto) { k.mass_matrix(q, o.a.data()); }},
      {"bias", [&k, buffers, &o](auto q, auto v, auto) { k.bias(q, v, o.a.data()); }},
      {"center_of_mass",
       [&k, buffers, &o](auto q, auto v, auto) {
         k.center_of_mass(q, v, o.a.data(), o.b.data(), o.c.data());
       }},
      {"centroidal_momentum",
       [&k, buffers, &o](auto q, auto v, auto) { k.centroidal_momentum(q, v, o.a.data()); }},
      {"energy", [&k, buffers, &o](auto q, auto v, auto) { k.energy(q, v, o.a.data()); }},
      {"site_motion",
       [&k, buffers, &o](auto q, auto v, auto tau) {
         k.site_motion(q, v, tau, o.a.data(), o.b.data(), o.c.data());
       }},
      {"site_twists",
       [&k, buffers, &o](auto q, auto v, auto) { k.site_twists(q, v, o.a.data(), o.b.data()); }},
      {"site_jacobians",
       [&k, buffers, &o](auto q, auto, auto) { k.site_jacobians(q, o.a.data()); }},
      {"sensor_wrenches",
       [&k, buffers, &o](auto q, auto v, auto tau) {
         k.sensor_wrenches(q, v, tau, o.wrench.data(), o.a.data());
       }},
  };
  for (const auto& [name, call] : rows) add(name + end, library, call);
}

void add_robot(const std::string& robot, bool floating_base) {
  const std::string path = std::string(TANDEM_MODEL_FOLDER "/") + robot + "_kernels.so";
  for (const char* variant : {"baseline", "x86-64-v3", "x86-64-v4"}) {
    const auto library = model::load_kernels(path, {}, variant);
    if (library) {
      add_kernels(robot, *library);
    } else {
      std::fprintf(stderr, "%s\n", library.error().to_string().c_str());
    }
  }
  register_pinocchio(robot, std::string(TANDEM_CONFIG_FOLDER "/") + robot + "/" + robot + ".urdf",
                     floating_base);
}

}  // namespace
}  // namespace tandem::bench

int main(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
  tandem::bench::add_robot("coman", true);
  tandem::bench::add_robot("walkman", true);
  for (const char* robot : {"panda", "ur5e", "double_pendulum"})
    tandem::bench::add_robot(robot, false);
  benchmark::RunSpecifiedBenchmarks();
}
