// What the benchmarks of one robot's dynamics share.
#pragma once

#include <string>
#include <vector>

namespace tandem::bench {

/// Random states of one robot: flat arrays, seeded, the base's quaternion of unit length.
struct States {
  static constexpr std::size_t kCount = 64;  // enough that no branch predictor learns them
  std::vector<std::vector<double>> q, v, tau;
};
[[nodiscard]] States random_states(std::size_t nq, std::size_t nv, bool floating_base);

/// Registers Pinocchio's rows for a robot, or one row that says that it is absent.
void register_pinocchio(const std::string& robot, const std::string& urdf, bool floating_base);

}  // namespace tandem::bench
