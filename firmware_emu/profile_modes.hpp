// The modes in which a drive makes its own way to a target: profile position, velocity and torque,
// interpolated position and homing (CiA 402).
// Layer: firmware_emu.  Thread: RT; add_to non-RT.
#pragma once

#include <array>
#include <cstdint>

#include "base/realtime.hpp"
#include "canopen/object_dictionary.hpp"
#include "canopen/objects.hpp"
#include "firmware_emu/homing_search.hpp"

namespace tandem {
class Archive;
}

namespace tandem::firmware {

/// A motion with limited acceleration. Units are the caller's.
struct Trapezoid {
  double position = 0.0;
  double velocity = 0.0;

  /// Towards `target`, where it ends at rest. @return whether it is there
  bool move(double target, double speed, double acceleration, double deceleration,
            double dt_s) noexcept TANDEM_RT;
  /// Towards the velocity, for ever. @return whether it has it
  bool run(double wanted, double acceleration, double deceleration, double dt_s) noexcept TANDEM_RT;
};

/// What the modes look at. Positions in drive counts, that is as 6064 has them.
struct ProfileInputs {
  canopen::Mode mode = canopen::Mode::kNone;
  std::uint16_t controlword = 0;
  bool follows = false;  ///< the drive follows its mode's reference now
  std::int32_t position = 0;
  std::int32_t target_position = 0;  ///< 607A, and 60C1:1
  std::int32_t target_velocity = 0;  ///< 60FF
  double velocity_units = 1.0;       ///< in a count per second: of 60FF, 6081, 6099
  double acceleration_units = 1.0;   ///< in a count per second and second: of 6083, 6084, 609A
  std::int16_t target_torque = 0;    ///< 6071
  std::int16_t torque = 0;           ///< 6077
  HomingSenses senses{};             ///< homing's
};

/// Where the joint controllers go, and bits of the statusword.
struct ProfileOutputs {
  std::int32_t position = 0;
  std::int32_t velocity = 0;
  std::int16_t torque = 0;
  bool target_reached = false;  ///< bit 10
  bool bit_12 = false;          ///< set-point acknowledged; speed 0; homing attained; ip active
  bool bit_13 = false;          ///< homing error
  bool homed = false;           ///< just now: the position here is the home offset (607C)
};

/// Stepped once per control period.
///
/// Homing has the methods of HomingSearch, or those of them that the drive names; every other one
/// ends at once with a homing error.
class ProfileModes {
 public:
  /// Adds 6098, 6099, 609A and 607C of the axis, and for a drive with profile modes also 6081, 6083
  /// and 6084; 6087 is of profile torque alone then.
  /// @param modes  the axis', bits of 6502
  /// @return false when `od` is full.
  bool add_to(canopen::ObjectDictionary& od, int axis, std::uint32_t modes);
  /// @param methods  bit n: the drive has homing method n
  void allow_homing(std::uint64_t methods) noexcept { homing_methods_ = methods; }

  /// Is it one of these modes?
  [[nodiscard]] static bool has(canopen::Mode mode) noexcept TANDEM_RT;
  /// The cyclic mode that follows its outputs.
  [[nodiscard]] static canopen::Mode cyclic(canopen::Mode mode) noexcept TANDEM_RT;

  ProfileOutputs step(const ProfileInputs& in, double dt_s) noexcept TANDEM_RT;

  [[nodiscard]] std::int32_t home_offset() const noexcept { return home_offset_; }
  /// The drive is enabled anew: it stays where it is, whatever it was to reach before.
  void forget_target() noexcept TANDEM_RT {
    if (mode_ == canopen::Mode::kPp) mode_ = canopen::Mode::kNone;
  }
  void power_on() noexcept TANDEM_RT;
  void archive(Archive& ar);

 private:
  enum class Homing : std::uint8_t { kIdle, kSeeks, kDone, kFailed };

  void restart(const ProfileInputs& in) noexcept;
  void position_mode(const ProfileInputs& in, double dt_s) noexcept;
  void velocity_mode(const ProfileInputs& in, double dt_s) noexcept;
  void torque_mode(const ProfileInputs& in, double dt_s) noexcept;
  void interpolated(const ProfileInputs& in) noexcept;
  void homing_mode(const ProfileInputs& in, double dt_s) noexcept;
  void take_set_point(const ProfileInputs& in) noexcept;
  void end_homing(Homing how) noexcept;
  // A drive that has one of 6083 and 6084 takes it for both.
  [[nodiscard]] double speeding() const noexcept {
    return acceleration_ != 0 ? acceleration_ : deceleration_;
  }
  [[nodiscard]] double slowing() const noexcept {
    return deceleration_ != 0 ? deceleration_ : acceleration_;
  }

  // Objects
  std::uint32_t speed_ = 0;         ///< 6081 [velocity units]
  std::uint32_t acceleration_ = 0;  ///< 6083 [velocity units / s]
  std::uint32_t deceleration_ = 0;  ///< 6084
  std::uint32_t torque_slope_ = 0;  ///< 6087 [per mille/s]; 0: as steep as it likes
  std::array<std::uint32_t, 2> homing_speeds_{};
  std::uint32_t homing_acceleration_ = 0;
  std::int32_t home_offset_ = 0;
  std::int8_t homing_method_ = 0;
  std::uint64_t homing_methods_ = ~std::uint64_t{0};
  HomingSearch search_;

  canopen::Mode mode_ = canopen::Mode::kNone;
  Trapezoid motion_;  ///< its position counts from start_
  std::int32_t start_ = 0;
  std::int32_t target_ = 0;
  std::int32_t next_target_ = 0;  ///< waits for the one before
  double torque_ = 0.0;
  bool followed_ = false;
  bool bit_4_ = false;  ///< of the controlword, in the period before
  bool waiting_ = false;
  Homing homing_ = Homing::kIdle;
  ProfileOutputs out_;
};

}  // namespace tandem::firmware
