// 01: runs a simulated robot with its controllers and prints its first joint's path. From build/…:
//   bin/example_01_run ../../config/double_pendulum/trajectory.toml
#include <cstdio>

#include "runtime/run/run.hpp"

using namespace tandem;

int main(int argc, char** argv) {
  if (argc != 2) return 2;
  const auto run = runtime::Run::open(argv[1]);
  if (!run) {
    for (const Error& error : run.error()) std::puts(error.to_string().c_str());
    return 2;
  }
  const hal::StateImage& state = (*run)->state();
  while ((*run)->step()) {
    if (state.cycle()[0] % 500 != 0) continue;
    std::printf("%5.1f s  %.3f rad\n", static_cast<double>(state.time_ns()[0]) * 1e-9,
                state.position_rad()[0]);
  }
  return (*run)->cycle().faults().empty() ? 0 : 1;
}
