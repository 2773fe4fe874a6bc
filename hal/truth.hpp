// What a simulation knows beyond what its robot measures: an image of its own, for the log, the
// report and the run's figures. Controllers never see it.
// Layer: hal.  Thread: as the images.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "hal/image.hpp"

namespace tandem::hal {

/// n = joints, f = feet (the contact configuration's order), l = loops, p = passive joints (both
/// in the robot.toml's order; a robot without any has no such fields). W is z-up.
class TruthImage : public Image {
 public:
  TruthImage(std::size_t joints, std::size_t feet, std::size_t loops = 0,
             std::size_t passive = 0);

#define TANDEM_TRUTH(type, name)                                                        \
  [[nodiscard]] std::span<type> name() noexcept {                                       \
    return field<type>(name##_.offset, name##_.count);                                  \
  }                                                                                     \
  [[nodiscard]] std::span<const type> name() const noexcept {                           \
    return field<type>(name##_.offset, name##_.count);                                  \
  }
  TANDEM_TRUTH(std::uint64_t, cycle)             ///< (1) number of the loop's cycle
  TANDEM_TRUTH(std::int64_t, time_ns)            ///< (1) its nominal time
  TANDEM_TRUTH(double, base_position_m)          ///< (3) base origin in W; 0 on a fixed base
  TANDEM_TRUTH(double, base_quaternion)          ///< (4) x y z w, base to W
  TANDEM_TRUTH(double, base_velocity)            ///< (6) in the base's frame: linear, angular
  TANDEM_TRUTH(double, center_of_mass_m)         ///< (3) in W
  TANDEM_TRUTH(double, position_rad)             ///< (n) link position
  TANDEM_TRUTH(double, velocity_rad_s)           ///< (n) link velocity
  TANDEM_TRUTH(double, torque_Nm)                ///< (n) on the link, from the spring
  TANDEM_TRUTH(double, foot_position_m)          ///< (3f) origin of the foot's site in W
  TANDEM_TRUTH(double, foot_force_N)             ///< (3f) of the ground on the foot, W axes
  TANDEM_TRUTH(double, foot_moment_Nm)           ///< (3f) about the site's origin, W axes
  TANDEM_TRUTH(double, hoist_share)              ///< (1) 1: the base is held, 0: it is free
  TANDEM_TRUTH(double, loop_position_error_m)    ///< (l) how far each loop is open
  TANDEM_TRUTH(double, loop_velocity_error_m_s)  ///< (l) and how fast it opens
  TANDEM_TRUTH(double, passive_position_rad)     ///< (p) of the joints without a motor
#undef TANDEM_TRUTH

  [[nodiscard]] std::size_t joints() const noexcept { return position_rad_.count; }
  [[nodiscard]] std::size_t feet() const noexcept { return foot_position_m_.count / 3; }
  [[nodiscard]] std::size_t passive() const noexcept { return passive_position_rad_.count; }
  [[nodiscard]] std::size_t loops() const noexcept { return loop_position_error_m_.count; }

 private:
  struct Slot {
    std::size_t offset = 0;
    std::size_t count = 0;
  };
  Slot cycle_, time_ns_, base_position_m_, base_quaternion_, base_velocity_, center_of_mass_m_,
      position_rad_, velocity_rad_s_, torque_Nm_, foot_position_m_, foot_force_N_,
      foot_moment_Nm_, hoist_share_, loop_position_error_m_, loop_velocity_error_m_s_,
      passive_position_rad_;
};

}  // namespace tandem::hal
