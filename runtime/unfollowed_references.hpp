// Position references that controllers write where no drive follows them: for log and statistics.
// Layer: runtime.  Thread: made non-RT; the rest RT.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include "base/realtime.hpp"
#include "hal/image.hpp"

namespace tandem::runtime {

/// The position reference of a joint outside position control is NaN, not known, unless a
/// controller writes one in this cycle: what it wants the joint to follow by other means. What the
/// limits and the drive get there is where the joint is. Before the limits, which know no other:
/// offer(), the controllers, take(), keep().
class UnfollowedReferences {
 public:
  explicit UnfollowedReferences(const hal::ImageShape& shape)
      : written_(shape.joints), written_rad_(shape.joints), told_(shape) {}

  /// Each cycle, first.
  void begin() noexcept TANDEM_RT { std::ranges::fill(written_, std::uint8_t{0}); }
  void offer(const hal::StateImage& state, hal::CommandImage& command) noexcept TANDEM_RT {
    const auto measured = state.position_rad();
    for (std::size_t j = 0; j < written_.size(); ++j) {
      const bool offers = !is_followed(command, j) && std::isfinite(measured[j]);
      written_[j] = offers ? 1 : 0;
      if (offers) command.position_rad()[j] = measured[j];
    }
  }
  void take(const hal::StateImage& state, const hal::CommandImage& command) noexcept TANDEM_RT {
    const auto measured = state.position_rad(), reference = command.position_rad();
    for (std::size_t j = 0; j < written_.size(); ++j) {
      if (is_followed(command, j) || reference[j] == measured[j]) written_[j] = 0;
    }
  }
  /// Each cycle, of the command that goes to the limits.
  void keep(const hal::CommandImage& command) noexcept TANDEM_RT {
    const auto reference = command.position_rad();
    for (std::size_t j = 0; j < written_.size(); ++j) {
      if (!std::isfinite(reference[j]) || is_followed(command, j)) written_[j] = 0;
      written_rad_[j] = reference[j];
    }
  }
  /// `command`, which has passed the limits, with what is known of these references.
  [[nodiscard]] const hal::CommandImage& in(const hal::CommandImage& command) noexcept TANDEM_RT {
    bool differs = false;
    for (std::size_t j = 0; j < written_.size(); ++j) {
      if (is_followed(command, j)) continue;
      if (!differs) told_.assign(command);
      differs = true;
      told_.position_rad()[j] =
          written_[j] != 0 ? written_rad_[j] : std::numeric_limits<double>::quiet_NaN();
    }
    return differs ? told_ : command;
  }

 private:
  static bool is_followed(const hal::CommandImage& command, std::size_t joint) noexcept TANDEM_RT {
    return command.mode()[joint] == static_cast<std::int8_t>(hal::ControlMode::kPosition);
  }

  // In this cycle.
  std::vector<std::uint8_t> written_;
  std::vector<double> written_rad_;
  hal::CommandImage told_;
};

}  // namespace tandem::runtime
