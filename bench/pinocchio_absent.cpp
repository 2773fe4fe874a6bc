// What stands in for the comparison with Pinocchio where it is not installed.
#include <benchmark/benchmark.h>

#include "bench/kernels_bench.hpp"

namespace tandem::bench {

void register_pinocchio(const std::string& robot, const std::string&, bool) {
  benchmark::RegisterBenchmark(("forward_dynamics/" + robot + "/pinocchio").c_str(),
                               [](benchmark::State& state) {
                                 state.SkipWithError("Pinocchio was not found by CMake");
                                 for (auto _ : state) break;
                               });
}

}  // namespace tandem::bench
