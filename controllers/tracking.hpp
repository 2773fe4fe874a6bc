// How well joints follow: the figure that controllers of references tell.
// Layer: controllers.  Thread: any, RT-safe.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>

#include "base/realtime.hpp"
#include "hal/image.hpp"

namespace tandem {

inline constexpr char kWorstErrorDoc[] = "largest distance of a joint from its reference";

/// Largest distance of one of `joints` from its reference [rad or m].
[[nodiscard]] inline double worst_error(std::span<const std::size_t> joints,
                                        const hal::StateImage& state,
                                        const hal::CommandImage& command) noexcept TANDEM_RT {
  double worst = 0.0;
  for (const std::size_t j : joints) {
    worst = std::max(worst, std::abs(command.position_rad()[j] - state.position_rad()[j]));
  }
  return worst;
}

}  // namespace tandem
