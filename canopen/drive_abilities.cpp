// Modes from 6502, or from the objects that each needs.
#include "canopen/drive_abilities.hpp"

#include <array>
#include <cmath>
#include <cstdio>

#include "canopen/eds.hpp"
#include "canopen/pdo.hpp"

namespace tandem::canopen {

using enum DataType;

const SheetEntry* offered(const DataSheet& sheet, std::uint16_t index, std::uint8_t sub,
                          DataType type) {
  const SheetEntry* entry = sheet.find(index, sub);
  if (entry == nullptr || entry->type != static_cast<std::uint16_t>(type)) return nullptr;
  const bool manufacturer = index >= 0x2000 && index < 0x6000;
  return manufacturer && entry->name != entry_name(index, sub) ? nullptr : entry;
}

bool writable(const DataSheet& sheet, std::uint16_t index, std::uint8_t sub) {
  const SheetEntry* entry = sheet.find(index, sub);
  return entry != nullptr && (entry->access & kWrite) != 0;
}

bool remappable(const DataSheet& sheet, std::uint16_t parameter) {
  const auto mapping =
      static_cast<std::uint16_t>(parameter + object::kRpdoMapping - object::kRpdoParameter);
  return writable(sheet, mapping, 0) && writable(sheet, mapping, 1) &&
         (sheet.find(parameter, kPdoCobId) == nullptr || writable(sheet, parameter, kPdoCobId));
}

namespace {

/// Whether one of the first PDOs of a direction (of a slave: any) can be mapped, or has the entry
/// from power-on, in its own length.
bool carried(const DataSheet& sheet, const SheetEntry& entry, Access right) {
  const bool receive = right == kMapRpdo;
  constexpr int kPdosOfSlave = 0x200;
  const std::uint32_t wanted = mapping_entry(entry.index, entry.sub, entry.size());
  const int pdos = sheet.ethercat ? kPdosOfSlave : kPdosPerNode;
  for (int i = 0; i < pdos; ++i) {
    const auto parameter =
        static_cast<std::uint16_t>((receive ? object::kRpdoParameter : object::kTpdoParameter) + i);
    if (remappable(sheet, parameter)) return true;
    const auto mapping =
        static_cast<std::uint16_t>((receive ? object::kRpdoMapping : object::kTpdoMapping) + i);
    const auto count = sheet.value(mapping, 0, 0).value_or(0);
    for (int sub = 1; sub <= count; ++sub) {
      if (sheet.value(mapping, static_cast<std::uint8_t>(sub), 0) == wanted) return true;
    }
  }
  return false;
}

}  // namespace

bool mappable(const DataSheet& sheet, std::uint16_t index, std::uint8_t sub, DataType type,
              Access right) {
  const SheetEntry* entry = offered(sheet, index, sub, type);
  return entry != nullptr && (entry->access & right) != 0 && carried(sheet, *entry, right);
}

namespace {

/// Profile position and velocity, where the ramps can be set. In profile velocity a drive runs on
/// when its master is gone, unless it watches it.
/// @param has  by 6502
template <class Has>
void take_profile_modes(const DataSheet& sheet, int axis, const Has& has, DriveAbilities& can) {
  const auto sets = [&](std::uint16_t index) { return writable(sheet, of_axis(index, axis), 0); };
  const auto target = [&](std::uint16_t index) {
    return mappable(sheet, of_axis(index, axis), 0, kInteger32, kMapRpdo);
  };
  const bool ramps = sets(object::kProfileAcceleration) || sets(object::kProfileDeceleration);
  const bool watches =
      sheet.ethercat || writable(sheet, object::kHeartbeatConsumer, 1) ||
      (writable(sheet, object::kGuardTime, 0) && writable(sheet, object::kLifeTimeFactor, 0));
  if (has(Mode::kPp) && ramps && sets(object::kProfileVelocity) &&
      target(object::kTargetPosition)) {
    can.position = Mode::kPp;
  }
  if (has(Mode::kPv) && ramps && watches && target(object::kTargetVelocity)) {
    can.velocity = Mode::kPv;
  }
}

}  // namespace

DriveAbilities abilities_of(const DataSheet& sheet, int axis) {
  const auto at = [axis](std::uint16_t index) { return of_axis(index, axis); };
  const auto by_rpdo = [&](std::uint16_t index, std::uint8_t sub, DataType type) {
    return mappable(sheet, at(index), sub, type, kMapRpdo);
  };
  const SheetEntry* supported = sheet.find(at(object::kSupportedModes));
  const bool told = supported != nullptr && supported->value && supported->value->number != 0;
  const auto has = [&](Mode mode) {
    return !told || (supported->value->number & mode_bit(mode)) != 0;
  };
  const bool period = sheet.has(at(object::kInterpolationPeriod));
  const bool velocity_offset = by_rpdo(object::kVelocityOffset, 0, kInteger32);
  const bool torque_offset = by_rpdo(object::kTorqueOffset, 0, kInteger16);
  // Without 6502, targets alone may be those of the profile modes: the cyclic ones have an
  // interpolation period or offsets. On EtherCAT process data is cyclic by itself.
  const bool cyclic = told || period || velocity_offset || sheet.ethercat;

  DriveAbilities can;
  can.machine = by_rpdo(object::kControlword, 0, kUnsigned16) &&
                mappable(sheet, at(object::kStatusword), 0, kUnsigned16, kMapTpdo) &&
                mappable(sheet, at(object::kPosition), 0, kInteger32, kMapTpdo);
  can.one_mode = !by_rpdo(object::kMode, 0, kInteger8);
  if (cyclic && has(Mode::kCsp) && by_rpdo(object::kTargetPosition, 0, kInteger32)) {
    can.position = Mode::kCsp;
  } else if (has(Mode::kIp) && by_rpdo(object::kInterpolationData, 1, kInteger32)) {
    can.position = Mode::kIp;
  }
  if (cyclic && has(Mode::kCsv) &&
      (velocity_offset || by_rpdo(object::kTargetVelocity, 0, kInteger32))) {
    can.velocity = Mode::kCsv;
  }
  if (cyclic && has(Mode::kCst) &&
      (torque_offset || by_rpdo(object::kTargetTorque, 0, kInteger16))) {
    can.torque = Mode::kCst;
  }
  if (first_mode(can) == Mode::kNone) take_profile_modes(sheet, axis, has, can);
  if (can.one_mode) {
    if (can.position != Mode::kNone) can.velocity = Mode::kNone;
    if (first_mode(can) != can.torque) can.torque = Mode::kNone;
  }
  can.impedance = by_rpdo(object::kStiffness, 0, kReal32) && by_rpdo(object::kDamping, 0, kReal32);
  can.open_loop = by_rpdo(object::kTargetVoltage, 0, kInteger16);
  can.current = by_rpdo(object::kTargetCurrent, 0, kInteger16);
  can.homing = has(Mode::kHm) && !can.one_mode && writable(sheet, at(object::kHomingMethod), 0);
  can.settings = offered(sheet, at(object::kMotorResolution), 0, kUnsigned32) != nullptr;
  return can;
}

namespace {

/// The quotient of an object's sub 1 and 2.
struct Ratio {
  bool there = false;           ///< the sheet has the object
  std::optional<double> value;  ///< none: one of the two is not said, or is 0
  std::vector<UnitObject> of;   ///< what it was computed from
};

Ratio ratio_of(const DataSheet& sheet, std::uint16_t index) {
  Ratio ratio{.there = sheet.has(index), .value = {}, .of = {}};
  const auto over = sheet.value(index, 1, 0).value_or(0);
  const auto under = sheet.value(index, 2, 0).value_or(0);
  if (over <= 0 || under <= 0) return ratio;
  ratio.value = static_cast<double>(over) / static_cast<double>(under);
  ratio.of = {{index, 1, static_cast<std::uint32_t>(over)},
              {index, 2, static_cast<std::uint32_t>(under)}};
  return ratio;
}

void append(std::vector<UnitObject>& to, const std::vector<UnitObject>& more) {
  to.insert(to.end(), more.begin(), more.end());
}

// 60A9, CiA 303-2: prefix (a power of ten), numerator, denominator, reserved.
constexpr std::uint32_t kUnit = 0x00FFFF00;
constexpr std::uint32_t kRevolutionsPerMinute = 0x00B44700;
constexpr std::uint32_t kRevolutionsPerSecond = 0x00B40300;
constexpr std::uint32_t kIncrementsPerSecond = 0x00B50300;

/// What one such unit is in revolutions of the motor per second.
std::optional<double> revolutions_per_s(std::uint32_t unit) {
  const double power = std::pow(10.0, static_cast<std::int8_t>(unit >> 24));
  if ((unit & kUnit) == kRevolutionsPerMinute) return power / 60.0;
  if ((unit & kUnit) == kRevolutionsPerSecond) return power;
  return {};
}

bool is_increments_per_s(std::uint32_t unit) { return unit == kIncrementsPerSecond; }

}  // namespace

std::optional<double> ratio(const DataSheet& sheet, std::uint16_t index) {
  return ratio_of(sheet, index).value;
}

std::vector<int> homing_methods(const DataSheet& sheet, int axis) {
  const std::uint16_t index = of_axis(object::kHomingMethods, axis);
  std::vector<int> methods;
  for (const SheetEntry& entry : sheet.entries) {
    if (entry.index != index || entry.sub == 0 || !entry.value) continue;
    if (entry.value->number != 0) methods.push_back(static_cast<int>(entry.value->number));
  }
  return methods;
}

DriveUnits units_of(const DataSheet& sheet, int axis) {
  const auto at = [axis](std::uint16_t index) { return of_axis(index, axis); };
  DriveUnits units;
  const Ratio feed = ratio_of(sheet, at(object::kFeedConstant));
  const Ratio encoder = ratio_of(sheet, at(object::kEncoderResolution));
  Ratio gear = ratio_of(sheet, at(object::kGearRatio));
  if (!gear.there) gear.value = 1.0;
  if (feed.there) {
    units.counts_per_rev = feed.value;
    units.position = feed.of;
  } else if (encoder.value && gear.value) {
    units.counts_per_rev = *encoder.value * *gear.value;
    units.position = encoder.of;
    append(units.position, gear.of);
  }
  const auto unit =
      static_cast<std::uint32_t>(sheet.value(at(object::kVelocityUnit), 0, 0).value_or(0));
  if (const auto per_s = revolutions_per_s(unit); per_s && !gear.of.empty()) {
    units.velocity_per_rev = *gear.value / *per_s;
    units.velocity = gear.of;
    units.velocity.push_back({at(object::kVelocityUnit), 0, unit});
  } else if (unit != 0 && !is_increments_per_s(unit)) {
    units.unknown_velocity = unit;
  }
  const auto rated_mNm = sheet.value(at(object::kRatedTorque), 0, 0).value_or(0);
  if (rated_mNm > 0 && gear.value) {
    units.rated_torque_Nm = 1e-3 * static_cast<double>(rated_mNm) * *gear.value;
    units.torque = gear.of;
    units.torque.push_back({at(object::kRatedTorque), 0, static_cast<std::uint32_t>(rated_mNm)});
  }
  return units;
}

std::string values_of(const DataSheet& sheet, int axis, std::span<const std::uint16_t> objects) {
  std::string text;
  const auto value = [&](std::uint16_t index, std::uint8_t sub) {
    const auto found = sheet.value(index, sub, 0);
    return found ? std::to_string(*found) : std::string("not said");
  };
  for (const std::uint16_t axis_0 : objects) {
    const std::uint16_t index = of_axis(axis_0, axis);
    if (!text.empty()) text += ", ";
    std::array<char, 8> name{};
    (void)std::snprintf(name.data(), name.size(), "%04X", unsigned{index});
    text += name.data();
    if (!sheet.has(index)) {
      text += " is not there";
    } else if (sheet.find(index, 1) == nullptr) {
      text += " is " + value(index, 0);
    } else {
      text += " is " + value(index, 1) + " / " + value(index, 2);
    }
  }
  return text;
}

}  // namespace tandem::canopen
