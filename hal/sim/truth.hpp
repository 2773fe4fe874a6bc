// Fills the truth image from the plant.
// Layer: hal/sim.  Thread: create non-RT; fill RT.
#pragma once

#include <cstddef>
#include <vector>

#include "base/realtime.hpp"
#include "hal/backend.hpp"
#include "hal/sim/plant.hpp"
#include "hal/truth.hpp"

namespace tandem::sim {

/// Numbers of the ground's place in a truth image: 0 where it never moves.
[[nodiscard]] inline std::size_t ground_numbers(const Plant& plant) {
  return plant.contact().terrain().moves() ? 3 : 0;
}

/// Copies the plant's present state into a truth image, joints in the process image's order.
class TruthFiller {
 public:
  explicit TruthFiller(const Plant& plant)
      : com_velocity_(3, 0.0), com_jacobian_(std::size_t{3} * plant.kernels().nv, 0.0) {}

  /// @pre plant.evaluate() since its last advance.
  void fill(Plant& plant, const hal::CycleTime& time, hal::TruthImage& truth) noexcept TANDEM_RT;

 private:
  std::vector<double> com_velocity_, com_jacobian_;  // what the kernel computes besides
};

}  // namespace tandem::sim
