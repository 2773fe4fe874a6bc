// What a run estimates of its robot beyond what is measured: an image of its own, for controllers,
// the log, DDS and the report, where an experiment declares [estimation].
// Layer: hal.  Thread: as the images.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "hal/image.hpp"

namespace tandem::hal {

/// What an EstimateImage has room for. Zero where nothing is declared.
struct EstimateShape {
  std::size_t base = 0;      ///< 1: a floating base
  std::size_t feet = 0;      ///< of the robot's feet, in its order; with the base
  std::size_t joints = 0;    ///< of the observer's external torques, in the state image's order
  std::size_t wrenches = 0;  ///< declared places, in the order of [[estimation.wrench]]
};

/// The accessors of hal/estimate_fields.inc. W is z-up; its origin is below the base where the
/// estimate started, its x axis the base's forward then: position and yaw are not observable.
class EstimateImage : public Image {
#define TANDEM_FIELD TANDEM_IMAGE_MEMBERS
#include "hal/estimate_fields.inc"
#undef TANDEM_FIELD

 public:
  explicit EstimateImage(const EstimateShape& shape);

  /// Whether a base is estimated, and the estimate has started.
  [[nodiscard]] bool has_base() const noexcept {
    return base_valid_.count != 0 && base_valid()[0] != 0;
  }
  /// Whether the base is a part of the estimate, started or not.
  [[nodiscard]] bool estimates_base() const noexcept { return base_valid_.count != 0; }
  [[nodiscard]] std::size_t feet() const noexcept { return contact_probability_.count; }
  [[nodiscard]] std::size_t joints() const noexcept { return external_torque_Nm_.count; }
  [[nodiscard]] std::size_t wrenches() const noexcept { return external_force_N_.count / 3; }
};

}  // namespace tandem::hal
