// The torques of a robot that both its feet carry.
// Layer: controllers.  Thread: any.
#pragma once

#include <cstddef>
#include <span>

#include "base/realtime.hpp"
#include "model/kernels.h"

namespace tandem {

/// The two sites that touch the ground.
struct Feet {
  std::size_t left = 0;
  std::size_t right = 0;
};

/// Takes the ground's share out of inverse dynamics: the wrench on the base, which no motor can
/// give, must come from the ground. Half of its force acts at each foot, and half of its moment
/// about the point between the feet, so that the feet do not work against each other.
///
/// @param q     (nq) of a floating base
/// @param pose  (12 * sites), J (6 * nv * sites): of the kernels at q
/// @param tau   (nv) in: inverse dynamics without contact; out: the joints' torques with both
///              feet on the ground, and zero for the base
/// @rt    no allocation, lock or throw; O(nv).
void carry_on_both_feet(const tandem_kernels& kernels, const Feet& feet, std::span<const double> q,
                        std::span<const double> pose, std::span<const double> J,
                        std::span<double> tau) noexcept TANDEM_RT;

}  // namespace tandem
