// What a second robot beside the first shows while both run.
// Layer: hal.  Thread: plain data; newest() one reader's.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "hal/image.hpp"
#include "hal/truth.hpp"

namespace tandem::hal {

/// One cycle of the second robot, and how far the first was from it then.
struct ParallelView {
  StateImage state;  ///< of the second
  /// First minus second, by joint; zero unless both follow their command. [rad, rad/s, Nm; m, m/s,
  /// N]
  std::vector<double> position_rad, velocity_rad_s, torque_Nm;
  std::uint64_t behind_cycles = 0;    ///< the first was so much further
  std::uint64_t missed = 0;           ///< commands that the second never got, so far
  std::optional<TruthImage> truth{};  ///< of the second, in the same cycle; empty: it has none
};

/// What one reader sees of it.
class ParallelSource {
 public:
  virtual ~ParallelSource() = default;
  /// The newest cycle, until the next call; null: there is none yet. One thread's.
  [[nodiscard]] virtual const ParallelView* newest() noexcept = 0;
};

}  // namespace tandem::hal
