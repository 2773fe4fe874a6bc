// What a simulation knows beyond what its robot measures: an image of its own, for the log, the
// report and the run's figures. Controllers never see it.
// Layer: hal.  Thread: as the images.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>

#include "hal/image.hpp"

namespace tandem::hal {

/// The accessors of hal/truth_fields.inc. Feet are in the contact configuration's order, loops and
/// passive joints in the robot.toml's. W is z-up.
class TruthImage : public Image {
#define TANDEM_FIELD TANDEM_IMAGE_MEMBERS
#include "hal/truth_fields.inc"
#undef TANDEM_FIELD

 public:
  /// @param ground  3: it moves, 0: it does not
  TruthImage(std::size_t joints, std::size_t feet, std::size_t loops = 0, std::size_t passive = 0,
             std::size_t ground = 0);

  [[nodiscard]] std::size_t joints() const noexcept { return position_rad_.count; }
  [[nodiscard]] std::size_t feet() const noexcept { return foot_position_m_.count / 3; }
  [[nodiscard]] std::size_t passive() const noexcept { return passive_position_rad_.count; }
  [[nodiscard]] bool ground_moves() const noexcept { return ground_position_m_.count > 0; }
  [[nodiscard]] std::size_t loops() const noexcept { return loop_position_error_m_.count; }
};

/// The angle between the z axis of a frame with orientation `quaternion` (x y z w) and W's [rad].
[[nodiscard]] inline double tilt_of(std::span<const double> quaternion) noexcept {
  // The frame's z axis in W is the rotation matrix's last column.
  const double x = quaternion[0], y = quaternion[1], z = quaternion[2], w = quaternion[3];
  const double zx = 2.0 * (x * z + w * y);
  const double zy = 2.0 * (y * z - w * x);
  const double zz = 1.0 - 2.0 * (x * x + y * y);
  return std::atan2(std::hypot(zx, zy), zz);
}

}  // namespace tandem::hal
