// The objects of one axis as they are on the wire, and their entries in the dictionary.
// Layer: firmware_emu.  Thread: RT; construction non-RT.
#pragma once

#include <array>
#include <cstdint>
#include <limits>

#include "base/realtime.hpp"
#include "canopen/drive_machine.hpp"
#include "canopen/drive_parameters.hpp"
#include "canopen/object_dictionary.hpp"
#include "canopen/objects.hpp"

namespace tandem::firmware {

/// Manufacturer's objects that only the firmware knows; axis 0, see canopen::of_axis().
namespace object {
inline constexpr std::uint16_t kTelemetry = 0x2040;      // f32: TelemetrySub
inline constexpr std::uint16_t kRefusedValues = 0x2041;  // u32: values by PDO not taken
/// Object of the board, not of an axis.
inline constexpr std::uint16_t kIgnoredFrames = 0x2050;  // u32: no frame of CAN or CAN FD
}  // namespace object

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
  std::uint32_t refused_values = 0;
  std::uint32_t digital_inputs = 0;
  std::uint32_t digital_outputs = 0;
  std::array<float, kTelemetryValues> telemetry{};
  std::array<std::uint32_t, canopen::kDriveObjects.size()> settings{};  ///< row by row
  // 2 bytes
  std::uint16_t error_code = 0;
  std::uint16_t controlword = 0;
  std::uint16_t statusword = 0;
  std::int16_t torque = 0;
  std::int16_t target_torque = 0;
  std::int16_t torque_offset = 0;
  std::int16_t current = 0;
  std::int16_t voltage = 0;
  std::int16_t temperature = 0;
  std::int16_t target_voltage = 0;
  std::int16_t target_current = 0;
  std::int16_t abort_option = 1;  ///< 6007: 0 nothing, 1 fault, 2 disable voltage, 3 quick stop
  canopen::DriveOptions options{};
  // 1 byte
  std::int8_t mode = 0;
  std::int8_t mode_display = 0;
  std::uint8_t interpolation_units = 1;  ///< 60C2: 1 ms; nothing is interpolated
  std::int8_t interpolation_power = -3;
  std::array<std::uint8_t, 2> reserved{};  ///< no padding in a snapshot

  /// Enters every variable; `owner` is asked about the ones that are more than a variable.
  /// @return false when the dictionary is too small.
  bool add_to(canopen::ObjectDictionary& od, int axis, canopen::ObjectOwner& owner);

  void set(const canopen::DriveParameters& parameters) noexcept TANDEM_RT;
  /// What the settings mean.
  [[nodiscard]] canopen::DriveParameters parameters() const noexcept TANDEM_RT;

 private:
  bool add_profile(canopen::ObjectDictionary& od, int axis, canopen::ObjectOwner& owner);
  bool add_actual(canopen::ObjectDictionary& od, int axis);
  bool add_demands(canopen::ObjectDictionary& od, int axis);
  bool add_settings(canopen::ObjectDictionary& od, int axis, canopen::ObjectOwner& owner);
};

}  // namespace tandem::firmware
