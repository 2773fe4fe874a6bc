// One axis between the image's SI units and the wire's integers. Clamped, never wrapped.
// Layer: hal/ethercat-can.  Thread: any.
#pragma once

#include <cstdint>
#include <utility>

#include "base/realtime.hpp"
#include "canopen/drive_abilities.hpp"
#include "canopen/drive_machine.hpp"
#include "canopen/objects.hpp"
#include "hal/config/robot_config.hpp"
#include "hal/ethercat-can/pdo_layout.hpp"
#include "hal/image.hpp"

namespace tandem {
class Archive;
}

namespace tandem::hal::can {

/// Factors of one joint's wire units.
struct AxisScale {
  double counts_per_rad = 1.0;           ///< link encoder, 608F / 2 pi; negative: it counts down
  double velocity_per_rad_s = 1.0;       ///< of 606C, 60FF and 60B1; counts/s but for other units
  double acceleration_per_rad_s2 = 1.0;  ///< of 6083, 6084 and 609A
  double motor_counts_per_rad = 1.0;     ///< motor encoder reflected to the link, 2033 / 2 pi
  double mille_per_Nm = 1.0;             ///< 1000 / rated torque (6076); negative with the counts
  std::int32_t zero_counts = 0;          ///< the drive's count at 0 rad
  std::int32_t turn_counts = 0;          ///< JointConfig::encoder_turn_counts
  std::int32_t middle_counts = 0;        ///< of the joint's range, from its zero

  /// A drive's count from the joint's zero, and back. Both wrap around as the drive's counter does:
  /// the joint's range is less than the counter's, so that a count means one angle.
  [[nodiscard]] std::int32_t from_zero(std::int32_t count) const noexcept TANDEM_RT {
    return static_cast<std::int32_t>(static_cast<std::uint32_t>(count) -
                                     static_cast<std::uint32_t>(zero_counts));
  }
  [[nodiscard]] std::int32_t to_drive(std::int32_t from_zero) const noexcept TANDEM_RT {
    return static_cast<std::int32_t>(static_cast<std::uint32_t>(from_zero) +
                                     static_cast<std::uint32_t>(zero_counts));
  }
  /// Moves the zero by turns of a single-turn encoder, so that the count is within half a turn of
  /// the middle of the joint's range.
  /// @param count  the drive's, when it is heard for the first time
  void find_turn(std::int32_t count) noexcept TANDEM_RT;
  /// Scale of a joint on one of our own boards, whose 608F, 2033 and 6076 are whole numbers.
  [[nodiscard]] static AxisScale of(const JointConfig& joint);
  /// The same; on a drive of another make the joint's numbers as they are: a ratio of its sheet
  /// need not be whole.
  [[nodiscard]] static AxisScale of(const RobotConfig& robot, const JointConfig& joint);
};

inline constexpr double kAmperePerUnit = 0.01;
inline constexpr double kVoltPerUnit = 0.01;
inline constexpr double kKelvinPerUnit = 0.1;

/// What a drive said last, as on the wire.
struct RawFeedback {
  std::int32_t position = 0;
  std::int32_t velocity = 0;
  std::int32_t motor_position = 0;
  std::int32_t motor_velocity = 0;
  std::uint16_t statusword = 0;
  std::uint16_t error_code = 0;
  std::int16_t torque = 0;
  std::int16_t current = 0;
  std::int16_t voltage = 0;
  std::int16_t temperature = 0;
  std::int8_t mode_display = 0;

  /// The variable of a feedback field; null: the field travels the other way.
  [[nodiscard]] void* variable(WireField field) noexcept;
  /// Takes over the values that travel every SYNC.
  void adopt(const RawFeedback& sample) noexcept TANDEM_RT;
  void archive(Archive& ar);
};

/// What a drive is commanded, as on the wire.
struct RawCommand {
  std::int32_t target_position = 0;
  std::int32_t velocity_offset = 0;
  float stiffness = 0.0F;
  float damping = 0.0F;
  std::uint16_t controlword = 0;
  std::int16_t torque_offset = 0;
  std::int16_t target_voltage = 0;
  std::int16_t target_current = 0;
  std::int8_t mode = 0;

  /// The variable of a command field; null: the field travels the other way.
  [[nodiscard]] void* variable(WireField field) noexcept;
  void archive(Archive& ar);
};

/// The mode of operation for what the image asks; kNone for kIdle.
[[nodiscard]] canopen::Mode wire_mode(ControlMode mode, InteractionMode interaction,
                                      const canopen::DriveAbilities& can) noexcept TANDEM_RT;
/// The way back, for the mode display; kIdle for a mode that is none of ours.
[[nodiscard]] std::pair<ControlMode, InteractionMode> image_mode(
    std::int8_t mode) noexcept TANDEM_RT;

/// Everything but the controlword: references, feed-forward and mode (kIdle: the mode stays).
void encode_command(const AxisScale& scale, const canopen::DriveAbilities& can,
                    const CommandImage& command, std::size_t joint,
                    RawCommand& raw) noexcept TANDEM_RT;
/// The drive's values into the image, but acceleration, fault and age.
void decode_feedback(const AxisScale& scale, const RawFeedback& raw, std::size_t joint,
                     StateImage& state) noexcept TANDEM_RT;

}  // namespace tandem::hal::can
