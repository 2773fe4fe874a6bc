// Entries, types, limits and access of an axis' objects; of its settings by the rows of
// canopen/drive_parameters.hpp. docs/firmware.md has the table.
#include "firmware_emu/axis_objects.hpp"

#include <algorithm>

namespace tandem::firmware {

namespace {

using namespace canopen;
namespace co = canopen::object;
namespace own = firmware::object;

/// Adds `values` as sub 1 to n, and their number as sub 0.
template <std::size_t n>
bool add_array(ObjectDictionary& od, std::uint16_t index, std::array<float, n>& values,
               std::uint8_t access, ObjectRange range = {}, ObjectOwner* owner = nullptr) {
  bool done = od.add_value<std::uint8_t>(index, 0, n);
  for (std::size_t i = 0; i < n; ++i) {
    done &= od.add(index, static_cast<std::uint8_t>(i + 1), values[i], access, range, owner);
  }
  return done;
}

/// A row's variable is the first bytes of its word.
template <class Word>
ObjectEntry entry_of(const DriveObject& object, Word& word) noexcept TANDEM_RT {
  return {.type = object.type, .size = object.size(), .data = const_cast<std::uint32_t*>(&word)};
}

}  // namespace

void AxisObjects::set(const DriveParameters& parameters) noexcept TANDEM_RT {
  for (std::size_t row = 0; row < settings.size(); ++row) {
    const DriveObject& object = kDriveObjects[row];
    entry_of(object, settings[row]).decode(object.encode(parameters).data());
  }
}

DriveParameters AxisObjects::parameters() const noexcept TANDEM_RT {
  DriveParameters read;
  std::array<std::uint8_t, 4> bytes{};
  for (std::size_t row = 0; row < settings.size(); ++row) {
    const DriveObject& object = kDriveObjects[row];
    entry_of(object, settings[row]).encode(bytes.data());
    object.decode(bytes.data(), read);
  }
  read.torque_limit_Nm = std::min(read.torque_limit_Nm, read.max_torque_Nm);
  return read;
}

bool AxisObjects::add_to(ObjectDictionary& od, int axis, ObjectOwner& owner) {
  return add_profile(od, axis, owner) && add_actual(od, axis) && add_demands(od, axis) &&
         add_settings(od, axis, owner);
}

bool AxisObjects::add_profile(ObjectDictionary& od, int axis, ObjectOwner& owner) {
  const auto at = [axis](std::uint16_t index) { return of_axis(index, axis); };
  return od.add(at(co::kAbortConnectionOption), 0, abort_option, kReadWrite, {0, 3}) &&
         od.add(at(co::kErrorCode), 0, error_code, kReadTpdo) &&
         od.add(at(co::kControlword), 0, controlword, kWriteRpdo) &&
         od.add(at(co::kStatusword), 0, statusword, kReadTpdo) &&
         od.add(at(co::kQuickStopOption), 0, options.quick_stop, kReadWrite, {-1, 6}, &owner) &&
         od.add(at(co::kShutdownOption), 0, options.shutdown, kReadWrite, {0, 1}) &&
         od.add(at(co::kDisableOption), 0, options.disable_operation, kReadWrite, {0, 1}) &&
         od.add(at(co::kHaltOption), 0, options.halt, kReadWrite, {1, 2}) &&
         od.add(at(co::kFaultReactionOption), 0, options.fault_reaction, kReadWrite, {-1, 2}) &&
         od.add_value<std::uint8_t>(at(co::kInterpolationPeriod), 0, 2) &&
         od.add(at(co::kInterpolationPeriod), 1, interpolation_units, kReadWrite, {1, 255}) &&
         od.add(at(co::kInterpolationPeriod), 2, interpolation_power, kReadWrite, {-128, 63}) &&
         od.add(at(co::kMode), 0, mode, kWriteRpdo, {-4, 10}, &owner) &&
         od.add(at(co::kModeDisplay), 0, mode_display, kReadTpdo) &&
         od.add_value(at(co::kSupportedModes), 0, kTandemModes);
}

bool AxisObjects::add_actual(ObjectDictionary& od, int axis) {
  const auto at = [axis](std::uint16_t index) { return of_axis(index, axis); };
  return od.add(at(co::kPosition), 0, position, kReadTpdo) &&
         od.add(at(co::kVelocity), 0, velocity, kReadTpdo) &&
         od.add(at(co::kTorque), 0, torque, kReadTpdo) &&
         od.add(at(co::kFollowingError), 0, following_error, kReadTpdo) &&
         od.add(at(co::kDigitalInputs), 0, digital_inputs, kReadTpdo) &&
         od.add_value<std::uint8_t>(at(co::kDigitalOutputs), 0, 1) &&
         od.add(at(co::kDigitalOutputs), 1, digital_outputs, kReadTpdo) &&
         od.add(at(co::kMotorPosition), 0, motor_position, kReadTpdo) &&
         od.add(at(co::kMotorVelocity), 0, motor_velocity, kReadTpdo) &&
         od.add(at(co::kCurrent), 0, current, kReadTpdo) &&
         od.add(at(co::kVoltage), 0, voltage, kReadTpdo) &&
         od.add(at(co::kTemperature), 0, temperature, kReadTpdo) &&
         add_array(od, at(own::kTelemetry), telemetry, kReadTpdo) &&
         od.add(at(own::kRefusedValues), 0, refused_values, kReadTpdo);
}

bool AxisObjects::add_demands(ObjectDictionary& od, int axis) {
  const auto at = [axis](std::uint16_t index) { return of_axis(index, axis); };
  return od.add(at(co::kTargetPosition), 0, target_position, kWriteRpdo) &&
         od.add(at(co::kTargetVelocity), 0, target_velocity, kWriteRpdo) &&
         od.add(at(co::kVelocityOffset), 0, velocity_offset, kWriteRpdo) &&
         od.add(at(co::kTargetTorque), 0, target_torque, kWriteRpdo) &&
         od.add(at(co::kTorqueOffset), 0, torque_offset, kWriteRpdo) &&
         od.add(at(co::kTargetVoltage), 0, target_voltage, kWriteRpdo) &&
         od.add(at(co::kTargetCurrent), 0, target_current, kWriteRpdo);
}

bool AxisObjects::add_settings(ObjectDictionary& od, int axis, ObjectOwner& owner) {
  bool done = od.add_value<std::uint32_t>(of_axis(co::kEncoderResolution, axis), 2, 1);
  for (std::size_t row = 0; row < settings.size(); ++row) {
    const DriveObject& object = kDriveObjects[row];
    const std::uint16_t index = of_axis(object.index, axis);
    ObjectEntry entry = entry_of(object, settings[row]);
    entry.index = index;
    entry.sub = object.sub;
    entry.access = object.access;
    entry.range = object.range;
    entry.owner = &owner;
    done = done && od.add(entry);
    if (object.sub != 1) continue;
    auto subs = static_cast<std::uint8_t>(
        std::ranges::count(kDriveObjects, object.index, &DriveObject::index));
    if (object.index == co::kEncoderResolution) ++subs;
    done = done && od.add_value<std::uint8_t>(index, 0, subs);
  }
  return done;
}

}  // namespace tandem::firmware
