// The objects of one axis as they are on the wire, and their entries in the dictionary.
// Layer: firmware_emu.  Thread: RT; construction non-RT.
#pragma once

#include <array>
#include <cstdint>
#include <limits>

#include "base/realtime.hpp"
#include "canopen/drive_machine.hpp"
#include "canopen/object_dictionary.hpp"
#include "canopen/objects.hpp"
#include "firmware_emu/setup.hpp"

namespace tandem::firmware {

/// Manufacturer's objects that only the firmware knows; axis 0, see canopen::of_axis().
namespace object {
inline constexpr std::uint16_t kEstimators = 0x2027;      // f32 [Hz]: EstimatorSub
inline constexpr std::uint16_t kTransferTime = 0x2028;    // f32 [s]
inline constexpr std::uint16_t kUndervoltage = 0x2035;    // f32 [V]
inline constexpr std::uint16_t kStopTime = 0x2036;        // f32 [s]
inline constexpr std::uint16_t kPositionMargin = 0x2037;  // f32 [rad]
inline constexpr std::uint16_t kMismatch = 0x2038;        // f32: MismatchSub
inline constexpr std::uint16_t kTelemetry = 0x2040;       // f32: TelemetrySub
inline constexpr std::uint16_t kRefusedValues = 0x2041;   // u32: values by PDO not taken
/// Object of the board, not of an axis.
inline constexpr std::uint16_t kIgnoredFrames = 0x2050;  // u32: no frame of CAN or CAN FD
}  // namespace object

enum EstimatorSub : std::uint8_t {
  kLinkVelocityCutoff = 1,
  kMotorVelocityCutoff,
  kTorqueRateCutoff,
};
enum MismatchSub : std::uint8_t {
  kMismatchWindow = 1,  ///< [rad]; 0: not watched
  kMismatchTimeout,     ///< [s]
};
enum TelemetrySub : std::uint8_t {
  kTorqueReference = 1,  ///< [Nm] into the torque loop, limited
  kTransferVoltage,      ///< [V] what is left of a mode change's step
  kPositionIntegral,     ///< [Nm]
  kVelocityIntegral,     ///< [Nm]
  kTorqueIntegral,       ///< [V]
  kCurrentIntegral,      ///< [V]
  kI2tLoad,              ///< 1: trips
  kOscillationLoad,      ///< 1: trips
};
inline constexpr std::size_t kTelemetryValues = 8;

/// Entries that an axis adds, for the dictionary's capacity.
inline constexpr std::size_t kAxisEntries = 136;

/// 6087: the torque reference may change as it likes.
inline constexpr std::uint32_t kNoTorqueSlope = std::numeric_limits<std::uint32_t>::max();

/// Plain variables behind the dictionary, the widest first: no padding. Units as in
/// canopen/objects.hpp.
struct AxisObjects {
  // 4 bytes
  std::int32_t position = 0;
  std::int32_t velocity = 0;
  std::int32_t motor_position = 0;
  std::int32_t motor_velocity = 0;
  std::int32_t following_error = 0;
  std::int32_t target_position = 0;
  std::int32_t target_velocity = 0;
  std::int32_t velocity_offset = 0;
  std::int32_t min_position = std::numeric_limits<std::int32_t>::min();
  std::int32_t max_position = std::numeric_limits<std::int32_t>::max();
  std::uint32_t following_window = 0;
  std::uint32_t rated_torque_mNm = 1000;
  std::uint32_t torque_slope = kNoTorqueSlope;  ///< [per mille of rated / s]
  std::uint32_t quick_stop_deceleration = 1;    ///< [counts/s^2]
  std::uint32_t link_counts = 1;
  std::uint32_t motor_counts = 1;
  std::uint32_t refused_values = 0;
  std::uint32_t digital_inputs = 0;
  std::uint32_t digital_outputs = 0;
  float stiffness = 0.0F;
  float damping = 0.0F;
  std::array<std::array<float, 4>, 4> gains{};  ///< position, velocity, torque, current; PidSub
  std::array<float, 2> feed_forward{};
  std::array<float, 3> motor_data{};
  std::array<float, 3> cutoffs_Hz{};
  std::array<float, 4> limits{};
  std::array<float, 2> i2t{};
  std::array<float, 2> mismatch{};
  std::array<float, 2> oscillation{};
  std::array<float, 2> excess{};
  float swing = 0.0F;
  float transfer_time_s = 0.0F;
  float undervoltage_V = 0.0F;
  float stop_time_s = 0.0F;
  float position_margin_rad = 0.0F;
  std::array<float, kTelemetryValues> telemetry{};
  // 2 bytes
  std::uint16_t error_code = 0;
  std::uint16_t controlword = 0;
  std::uint16_t statusword = 0;
  std::uint16_t following_timeout_ms = 0;
  std::array<std::uint16_t, 3> brake{};  ///< BrakeSub
  std::uint16_t max_torque = 0;          ///< [per mille of rated]
  std::int16_t torque = 0;
  std::int16_t target_torque = 0;
  std::int16_t torque_offset = 0;
  std::int16_t current = 0;
  std::int16_t voltage = 0;
  std::int16_t temperature = 0;
  std::int16_t target_voltage = 0;
  std::int16_t target_current = 0;
  std::uint16_t command_timeout = 0;
  std::int16_t temperature_limit = 0;
  std::int16_t abort_option = 1;  ///< 6007: 0 nothing, 1 fault, 2 disable voltage, 3 quick stop
  canopen::DriveOptions options{};
  // 1 byte
  std::int8_t mode = 0;
  std::int8_t mode_display = 0;
  std::uint8_t position_feedback = 0;
  std::uint8_t interpolation_units = 1;  ///< 60C2: 1 ms; nothing is interpolated
  std::int8_t interpolation_power = -3;
  std::array<std::uint8_t, 3> reserved{};  ///< no padding in a snapshot

  /// Power-on values.
  [[nodiscard]] static AxisObjects from(const AxisSetup& setup, int command_timeout_syncs);
  /// Enters every variable; `owner` is asked about the ones that are more than a variable.
  /// @return false when the dictionary is too small.
  bool add_to(canopen::ObjectDictionary& od, int axis, canopen::ObjectOwner& owner);

  /// What the controller makes of the objects. @pre positions in counts of link_counts
  [[nodiscard]] ControllerConfig controller() const noexcept TANDEM_RT;
  [[nodiscard]] double rad_per_count() const noexcept TANDEM_RT;
  [[nodiscard]] double rated_torque_Nm() const noexcept TANDEM_RT {
    return rated_torque_mNm * 1.0e-3;
  }

 private:
  bool add_profile(canopen::ObjectDictionary& od, int axis, canopen::ObjectOwner& owner);
  bool add_limits(canopen::ObjectDictionary& od, int axis, canopen::ObjectOwner& owner);
  bool add_actual(canopen::ObjectDictionary& od, int axis);
  bool add_demands(canopen::ObjectDictionary& od, int axis, canopen::ObjectOwner& owner);
  bool add_settings(canopen::ObjectDictionary& od, int axis, canopen::ObjectOwner& owner);
};

}  // namespace tandem::firmware
